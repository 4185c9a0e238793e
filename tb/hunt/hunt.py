# SPDX-License-Identifier: Apache-2.0
"""`make hunt`: random streams into every entity with a stream, for a given time.

make hunt [SEED=n] [MINUTES=n] [ENTITY="name name"] [JOBS=n] [CASE=entity-number] [WAVES=1]
"""

import argparse
import os
import random
import sys
import time
from collections import Counter, defaultdict
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from pathlib import Path
from unittest import mock

sys.path.insert(0, str(Path(__file__).parents[1]))

from hunt.simulate import STREAMS, Result, entities, run_design
from plenofir.fpga.tools.simulators import find_simulator
from plenofir_tb.runner import simulator_name


def hunt(names: list[str], seed: int, minutes: float, jobs: int) -> list[Result]:
    """Run designs of the entities in turn until the time is over; print faults as they come."""
    end = time.monotonic() + 60 * minutes
    draw = random.Random(seed)
    results: list[Result] = []
    running: set[Future[Result]] = set()
    turn = 0
    with ThreadPoolExecutor(jobs) as pool:
        while running or time.monotonic() < end:
            while len(running) < jobs and time.monotonic() < end:
                running.add(
                    pool.submit(run_design, names[turn % len(names)], draw.randrange(10**6))
                )
                turn += 1
            done, running = wait(running, return_when=FIRST_COMPLETED)
            for future in done:
                results.append(future.result())
                if results[-1].fault:
                    print(
                        f"make hunt CASE={results[-1].name} WAVES=1  # {results[-1].fault}",
                        flush=True,
                    )
    return results


def report(results: list[Result]) -> None:
    """Print how many cases of each kind ran."""
    counts: dict[str, Counter[str]] = defaultdict(Counter)
    for result in results:
        entity = result.name.rpartition("-")[0]
        counts[entity] += result.counts
        counts[entity] += Counter(streams=result.streams, designs=1, faults=bool(result.fault))
    for entity, found in sorted(counts.items()):
        print(
            f"{entity}: {found.pop('streams', 0)} cases on {found.pop('designs', 0)} designs, "
            f"{found.pop('faults', 0)} failed"
        )
        for kind, number in sorted(found.items()):
            print(f"  {number:6} {kind}")
    failed = sum(bool(result.fault) for result in results)
    print(f"{sum(r.streams for r in results)} cases on {len(results)} designs, {failed} failed")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int)
    parser.add_argument("--minutes", type=float, default=20)
    parser.add_argument("--entity", default="", help=", ".join(entities()))
    parser.add_argument("--case", default="", help="repeat one design: entity-number")
    parser.add_argument("--waves", action="store_true", help="write a waveform of that design")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    options = parser.parse_args()
    names = options.entity.split() or entities()
    entity, _, number = options.case.rpartition("-")
    unknown = sorted({*names, *([entity] if options.case else [])} - set(entities()))
    if options.waves and not options.case:
        print("WAVES=1 is for one design: CASE=ENTITY-NUMBER")
        return 2
    if unknown or (options.case and not number.isdecimal()):
        what = f"no hunt of {', '.join(unknown)}" if unknown else f"CASE={options.case}"
        print(f"{what}; entities are {', '.join(entities())}; a case is ENTITY-NUMBER")
        return 2
    with mock.patch.dict(os.environ, find_simulator(simulator_name(), brief=True).environment):
        if options.case:
            results = [run_design(entity, int(number), waves=options.waves)]
            print(results[0].fault or f"{results[0].streams} cases passed")
            if results[0].waves:
                print(f"waveform: {results[0].waves}")
        else:
            seed = (
                random.SystemRandom().randrange(1 << 31) if options.seed is None else options.seed
            )
            print(f"SEED={seed}, {STREAMS} cases on each design", flush=True)
            results = hunt(names, seed, options.minutes, options.jobs)
            report(results)
    return int(any(result.fault for result in results))


if __name__ == "__main__":
    sys.exit(main())
