"""Computes the validation book, docs/validation: values of pairsim beside exact solutions, benchmarks and other codes.

usage: scripts/validation SUBJECT ... | all [-o runs/validation] [--quick] [--pages]

Each subject writes its numbers to docs/validation/results/SUBJECT.json, from which the tables of the pages are made,
and its pictures. With --pages nothing is computed. With --quick cells are coarse and points few, and only DIR is
written to. The exit code is 1 if a difference is larger than allowed.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

from measuring import with_one_thread


def main() -> int:
    """Compute, and write the pages."""
    with_one_thread()
    from validation_book.pages import report, write_book
    from validation_book.subjects import SUBJECTS, computed

    form = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(prog="validation", description=__doc__, formatter_class=form)
    parser.add_argument("subjects", nargs="+", metavar="SUBJECT", choices=["all", *SUBJECTS], help=", ".join(SUBJECTS))
    parser.add_argument("-o", "--output", type=Path, default=Path("runs/validation"), metavar="DIR")
    parser.add_argument("--quick", action="store_true", help="coarse cells and few points, nothing but DIR is written")
    parser.add_argument("--pages", action="store_true", help="write the pages from existing results")
    arguments = parser.parse_args()
    names = list(SUBJECTS) if "all" in arguments.subjects else arguments.subjects
    good = True
    for name in [] if arguments.pages else names:
        begin = time.process_time()
        found = computed(SUBJECTS[name], arguments.output, quick=arguments.quick)
        print(report(name, found, time.process_time() - begin), flush=True)
        good = good and all(row.good for row in found.comparisons)
    if not arguments.quick:
        write_book()
    return int(not good)


if __name__ == "__main__":
    sys.exit(main())
