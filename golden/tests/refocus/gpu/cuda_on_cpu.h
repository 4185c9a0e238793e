// SPDX-License-Identifier: Apache-2.0
//
// Runs a kernel of CUDA C++ on the processor: blocks one after the other, threads as contexts that take turns at
// barriers. Shared memory begins with garbage, as on a GPU.

#include <setjmp.h>
#include <signal.h>
#include <ucontext.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <vector>

#define __global__
#define __device__
#define __forceinline__ inline
#define __launch_bounds__(threads)
#define __restrict__
#define __shared__
#define __align__(bytes) __attribute__((aligned(bytes)))

struct Place {
    unsigned x, y, z;
};

struct uint2 {
    unsigned x, y;
};

struct uint4 {
    unsigned x, y, z, w;
};

static Place threadIdx, blockIdx;

static constexpr size_t STACK_BYTES = 1 << 18;
static ucontext_t scheduler;
static std::vector<ucontext_t> contexts;
static std::vector<bool> ended;
static unsigned running;

static void __syncthreads() { swapcontext(&contexts[running], &scheduler); }

// Threads take turns between barriers, so one counter holds until all have read it.
static int __syncthreads_or(int here)
{
    static int count;
    if (running == 0) count = 0;
    count += here != 0;
    __syncthreads();
    const int any = count;
    __syncthreads();
    return any;
}

static unsigned __funnelshift_r(unsigned low, unsigned high, int bits)
{
    return unsigned(((unsigned long long)high << 32 | low) >> (bits & 31));
}

static unsigned __funnelshift_l(unsigned low, unsigned high, int bits)
{
    return unsigned(((unsigned long long)high << 32 | low) << (bits & 31) >> 32);
}

static int __vimin_s32_relu(int a, int b)
{
    const int least = a < b ? a : b;
    return least < 0 ? 0 : least;
}

static unsigned __dp4a(unsigned bytes, unsigned weights, unsigned sum)
{
    for (int n = 0; n < 32; n += 8) sum += (bytes >> n & 0xff) * (weights >> n & 0xff);
    return sum;
}

// Halves of 16 bits by the two lower bytes, all with a sign.
static int __dp2a_lo(int halves, int weights, int sum)
{
    return sum + short(halves) * (signed char)weights + (halves >> 16) * (signed char)(weights >> 8);
}

static unsigned __byte_perm(unsigned low, unsigned high, unsigned chosen)
{
    const unsigned long long bytes = (unsigned long long)high << 32 | low;
    unsigned result = 0;
    for (int n = 0; n < 4; n++) result |= unsigned(bytes >> 8 * (chosen >> 4 * n & 7) & 0xff) << 8 * n;
    return result;
}

template <class Number>
static Number atomicAdd(Number* to, Number more)
{
    const Number before = *to;
    *to += more;
    return before;
}

static void (*work)();
// Arguments of the kernel, of 64 bits each.
static const long long* given;

static void one_thread()
{
    work();
    ended[running] = true;
    swapcontext(&contexts[running], &scheduler);
}

static sigjmp_buf before_blocks;

static void leave_blocks(int) { siglongjmp(before_blocks, 1); }

// Runs `kernel` in all threads of all blocks; false if it touches a protected page. Threads that wait at a barrier which
// others never reach end the process.
static bool run_blocks(void (*kernel)(), const unsigned* grid, unsigned threads, unsigned char* shared,
                       size_t shared_bytes, const long long* arguments)
{
    work = kernel;
    given = arguments;
    struct sigaction leaving = {}, usual;
    leaving.sa_handler = leave_blocks;
    sigaction(SIGSEGV, &leaving, &usual);
    if (sigsetjmp(before_blocks, 1)) {
        sigaction(SIGSEGV, &usual, nullptr);
        return false;
    }
    static std::vector<char> stacks;
    stacks.resize(threads * STACK_BYTES);
    contexts.resize(threads);
    for (blockIdx.y = 0; blockIdx.y < grid[1]; blockIdx.y++)
        for (blockIdx.x = 0; blockIdx.x < grid[0]; blockIdx.x++) {
            memset(shared, 0xa5, shared_bytes);
            ended.assign(threads, false);
            for (unsigned t = 0; t < threads; t++) {
                getcontext(&contexts[t]);
                contexts[t].uc_stack.ss_sp = &stacks[t * STACK_BYTES];
                contexts[t].uc_stack.ss_size = STACK_BYTES;
                contexts[t].uc_link = nullptr;
                makecontext(&contexts[t], one_thread, 0);
            }
            for (unsigned done = 0; done < threads;) {
                for (running = 0; running < threads; running++) {
                    threadIdx = {running, 0, 0};
                    swapcontext(&scheduler, &contexts[running]);
                    done += ended[running];
                }
                if (done > 0 && done < threads) {
                    fprintf(stderr, "a barrier was not reached by all threads\n");
                    abort();
                }
            }
        }
    sigaction(SIGSEGV, &usual, nullptr);
    return true;
}
