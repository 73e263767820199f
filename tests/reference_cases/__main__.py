"""Prints every key of a file of cases beside what padlab finds: ``python -m reference_cases FILE``."""

import sys
from pathlib import Path

from reference_cases import compared, read_cases
from reference_cases.adapters import adapter_of
from reference_cases.own import known_data, own_cases


def main(arguments: list[str]) -> int:
    cases = read_cases(Path(arguments[0]), known=known_data()) if arguments else own_cases()
    wrong = 0
    for case in cases:
        if "ref" in case.data:
            sys.stdout.write(f"{case.id}: no data\n")
            continue
        try:
            found = list(compared(case, adapter_of(case)))
        except Exception as error:
            sys.stdout.write(f"{case.id}: {type(error).__name__}: {error}\n")
            wrong += 1
            continue
        for one in found:
            wrong += not one.good
            sys.stdout.write(
                f"{'ok   ' if one.good else 'WRONG'} {case.id} {one.key}: {one.error:.2g} of the tolerance"
                f" (rtol {one.allowed:g}){'' if one.good else f': found {one.found}, expected {one.expected}'}\n"
            )
    sys.stdout.write(f"{len(cases)} cases, {wrong} keys wrong\n")
    return min(wrong, 1)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
