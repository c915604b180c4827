"""Computes studies, says which of their statements hold, and writes their pages.

usage: scripts/study NAME ... | all [--quick] [--page] [--keep] [--only PATTERN] [--workers N] [-o runs/studies]

A study is a folder of scripts/studies. It is computed in parts, each of which is stored as soon as it is done, with a
hash of the code that it depends on. The same command therefore resumes after any kind of end; on another machine it
resumes from what is stored in the project. Parts whose code has changed are named and computed again, unless --keep is
given. With --only just the parts whose names match a regular expression are computed, and all that is stored is judged.
With --page nothing is computed: the results in the output folder are stored in the project, and the page, the pictures
and tables that ship, and the table of all studies in docs/validation/index.md are written from them. With --quick cells
are coarse and parts few, and nothing but the output folder is written to.

Exit code 0: all is computed, and every statement holds; 1: some do not, or there are no results yet; 2: an input is
wrong; 130: it was stopped, or its output is no longer read.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import sys
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import nullcontext
from pathlib import Path

import pandas as pd
from book import overview, pages
from book.results import Results
from book.study import Part, Row, Stopped, Study, Unavailable, names, study_of

from pairsim.record.folder import write_bytes, write_text
from pairsim.runtime.errors import InputError
from pairsim.runtime.locks import command_line, sole_writer
from pairsim.sweeps.folder import STOP

STOPPED = 130


def left(study: Study, parts: Sequence[Part], results: Results, *, keep: bool = False) -> list[Part]:
    """The parts without results, and those with stale ones unless these are kept; prints how many, and why."""
    found, why = list[Part](), Counter[str]()
    for part in parts:
        stale = results.stale(part, study.code_of(part))
        why.update(stale or ())
        if stale is None or (stale and not keep):
            found.append(part)
    for reason, count in why.items():
        print(f"{study.name}: {count} parts are stale, as {reason}", flush=True)
    print(f"{study.name}: {len(parts)} parts, {len(found)} to do", flush=True)
    return found


def compute(study: Study, todo: Sequence[Part], results: Results, workers: int = 1) -> None:
    """Compute parts.

    Args:
        study: The study.
        todo: The parts.
        results: Where each is stored.
        workers: Number of parts that are computed at the same time.

    Raises:
        KeyboardInterrupt: It was stopped; what is done is stored.
    """
    work = results.path.parent / "work"
    work.mkdir(parents=True, exist_ok=True)
    (work / STOP).unlink(missing_ok=True)
    with ThreadPoolExecutor(workers) as threads:
        begin = time.monotonic()
        running = {threads.submit(_rows, part, work): part for part in todo}
        try:
            for count, future in enumerate(as_completed(running), 1):
                part = running[future]
                try:
                    results.add(part, study.code_of(part), future.result())
                except Unavailable as lacking:
                    print(f"[{count}/{len(todo)}] {part.name} is left out: {lacking}", flush=True)
                    continue
                print(f"[{count}/{len(todo)}] {time.monotonic() - begin:.0f} s {part.name}", flush=True)
        except BaseException:
            (work / STOP).touch()  # the running cases end in order
            threads.shutdown(cancel_futures=True)
            raise


def _rows(part: Part, work: Path) -> Sequence[Row]:
    """The rows of a part, computed in a folder without files of an earlier attempt."""
    folder = work / part.name
    shutil.rmtree(folder, ignore_errors=True)
    return part.compute(folder)


def verdicts(study: Study, table: pd.DataFrame, parts: Sequence[Part]) -> bool:
    """Print which statements hold; returns whether all do."""
    found = study.statements(table, parts)
    for text, judged in found.items():
        print(f"{study.name}: {judged.verdict}: {text} ({judged.numbers})")
    return all(judged.verdict == "holds" for judged in found.values())


def write_files(files: Mapping[Path, str | bytes], folder: Path | None) -> None:
    """Write files that are made from results: to their own paths or, if a folder is given, into that."""
    for path, content in files.items():
        place = folder / path.name if folder else path
        if isinstance(content, bytes):
            write_bytes(place, content)
        else:
            write_text(place, content)


def drawn(study: Study, parts: Sequence[Part], work: Path) -> dict[Path, bytes]:
    """The pictures that parts have left in their folders, by the paths that they have in the project."""
    if study.pictures is None:
        return {}
    found = {study.pictures / f"{part.name}.png": work / part.name / f"{part.name}.png" for part in parts}
    return {path: file.read_bytes() for path, file in found.items() if file.is_file()}


def run(study: Study, output: Path, arguments: argparse.Namespace) -> bool:
    """Compute a study, or store it and write its page; returns whether all of its statements hold."""
    parts = study.parts(arguments.quick)
    print(f"{study.name}: {study.shows}")
    with nullcontext() if arguments.page else sole_writer(output, command_line()):
        results = Results(output / "results.csv", *([] if arguments.quick else [study.stored]))
        todo = left(study, parts, results, keep=arguments.keep)
        if not arguments.page:
            chosen = [part for part in todo if re.search(arguments.only, part.name)]
            compute(study, chosen, results, arguments.workers)
    table = results.of(parts)
    if table.empty:
        print(f"{study.name}: there are no results yet")
        return False
    if arguments.page:
        results.store(study.stored, parts)
        table = Results(study.stored).of(parts)
        write_files(drawn(study, parts, output / "work"), None)
        pages.write(study.page, study.blocks(table, parts))
    if arguments.page or arguments.quick:
        write_files(study.files(table, parts), output if arguments.quick else None)
    return verdicts(study, table, parts)


def main() -> int:
    """Run studies one after the other."""
    parser = argparse.ArgumentParser(
        prog="study", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("names", nargs="+", metavar="NAME", choices=["all", *names()], help=", ".join(names()))
    parser.add_argument("-o", "--output", type=Path, default=Path("runs/studies"), help="folder of the results")
    parser.add_argument("--workers", type=int, default=1, help="parts at the same time")
    parser.add_argument("--quick", action="store_true", help="coarse cells and few parts")
    parser.add_argument("--keep", action="store_true", help="keep results of code that has changed")
    parser.add_argument("--only", default="", metavar="PATTERN", help="compute parts whose names match it alone")
    parser.add_argument("--page", action="store_true", help="compute nothing, store the results and write the page")
    arguments = parser.parse_args()
    if arguments.quick and arguments.page:
        parser.error("--page: results of --quick are not stored in the project")
    chosen = names() if "all" in arguments.names else list(dict.fromkeys(arguments.names))
    try:
        form = "-quick" if arguments.quick else ""
        good = [run(study_of(name), arguments.output / f"{name}{form}", arguments) for name in chosen]
        if arguments.page:
            overview.write([study_of(name) for name in names()])
        sys.stdout.flush()
    except (KeyboardInterrupt, Stopped):
        print("stopped; the same command goes on")
        return STOPPED
    except BrokenPipeError:  # whoever read the output has enough of it, as `| head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # what is left to be printed
        return STOPPED
    except InputError as error:
        print(error, file=sys.stderr)
        return 2
    return int(not all(good))


if __name__ == "__main__":
    sys.exit(main())
