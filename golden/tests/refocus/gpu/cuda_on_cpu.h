// SPDX-License-Identifier: Apache-2.0
//
// Runs a kernel of CUDA C++ on the processor: blocks one after the other, threads as contexts that take turns at
// barriers. Shared memory begins with garbage, as on a GPU.

#include <ucontext.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <vector>

#define __global__
#define __device__
#define __launch_bounds__(threads)
#define __restrict__
#define __shared__
#define __align__(bytes) __attribute__((aligned(bytes)))

struct Place {
    unsigned x, y, z;
};

static Place threadIdx, blockIdx;

template <class Pixel>
struct Arguments {
    const Pixel* x;
    Pixel* out;
    const long long *reached_rows, *reached_columns;
    int numbers[6];
};

static constexpr size_t STACK_BYTES = 1 << 18;
static ucontext_t scheduler;
static std::vector<ucontext_t> contexts;
static std::vector<bool> ended;
static unsigned running;

static void __syncthreads() { swapcontext(&contexts[running], &scheduler); }

static void (*work)();

static void one_thread()
{
    work();
    ended[running] = true;
    swapcontext(&contexts[running], &scheduler);
}

// Runs `work` in all threads of all blocks. Threads that wait at a barrier which others never reach end the process.
static void run_blocks(unsigned grid_x, unsigned grid_y, unsigned threads, unsigned char* shared, size_t shared_bytes)
{
    static std::vector<char> stacks;
    stacks.resize(threads * STACK_BYTES);
    contexts.resize(threads);
    for (blockIdx.y = 0; blockIdx.y < grid_y; blockIdx.y++)
        for (blockIdx.x = 0; blockIdx.x < grid_x; blockIdx.x++) {
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
}
