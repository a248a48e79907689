"""Packs an installed tree into a wheel that needs no other package than numpy.

    wheel.py PREFIX VERSION OUTPUT [--gnuplot PROGRAM]

PREFIX holds the components `tool` and `python` of `cmake --install`. The wheel puts the tool into bin/, the files that
ship with it into share/swarmcert/, and into lib/swarmcert/ the shared libraries that are not part of the C and C++
runtime, and PROGRAM, which draws the plots of reports. All three are found relative to the tool, so the wheel works
below any prefix. Prints the wheel's path.

Linux only: the tag states the C library that the wheel was built with, and pip refuses older ones. Needs patchelf and
the package `wheel`.
"""

import argparse
import pathlib
import platform
import re
import shutil
import subprocess
import sys
import sysconfig
import tempfile

# Part of every system with the C library that the tag states.
RUNTIME = re.compile(r"(ld-linux|linux-vdso|lib(c|m|dl|rt|pthread|stdc\+\+|gcc_s)\.so)")


def run(*command):
    return subprocess.run(list(map(str, command)), check=True, capture_output=True, text=True).stdout


def bundled_libraries(program):
    """Paths of the shared libraries of `program`, direct and indirect, that the wheel has to bring along."""
    lines = run("ldd", program).splitlines()
    missing = [line.strip() for line in lines if "not found" in line]
    if missing:
        sys.exit(f"wheel.py: {program}: {missing[0]}")
    found = [line.split("=>")[1].split()[0] for line in lines if "=>" in line]
    return {path for path in found if not RUNTIME.match(pathlib.Path(path).name)}


def add_program(source, target, library_path):
    """Copies a program or module, or changes it in place, without debug information; it then looks for its libraries at
    `library_path`."""
    target.parent.mkdir(parents=True, exist_ok=True)
    if source != target:
        shutil.copy2(source, target)
    run("strip", "--strip-unneeded", target)
    run("patchelf", "--set-rpath", library_path, target)


def write_metadata(folder, version, tag):
    folder.mkdir()
    (folder / "WHEEL").write_text(f"Wheel-Version: 1.0\nGenerator: swarmcert\nRoot-Is-Purelib: false\nTag: {tag}\n")
    (folder / "METADATA").write_text(
        "Metadata-Version: 2.1\n"
        "Name: swarmcert\n"
        f"Version: {version}\n"
        "Summary: Formal verification and analysis for learned multirotor controllers\n"
        "License: BSD-3-Clause\n"
        "Classifier: Operating System :: POSIX :: Linux\n"
        f"Requires-Python: ~=3.{sys.version_info.minor}.0\n"
        "Requires-Dist: numpy\n"
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("prefix", type=pathlib.Path)
    parser.add_argument("version")
    parser.add_argument("output", type=pathlib.Path)
    parser.add_argument("--gnuplot", type=pathlib.Path)
    arguments = parser.parse_args()

    prefix = arguments.prefix
    abi = f"cp3{sys.version_info.minor}"
    libc = platform.libc_ver()[1].replace(".", "_")
    tag = f"{abi}-{abi}-manylinux_{libc}_{sysconfig.get_platform().split('-')[1]}"
    package = next(prefix.glob("**/swarmcert/__init__.py")).parent
    with tempfile.TemporaryDirectory() as scratch:
        root = pathlib.Path(scratch) / "wheel"
        data = root / f"swarmcert-{arguments.version}.data"
        libraries = data / "data/lib/swarmcert"
        shutil.copytree(package, root / "swarmcert")
        shutil.copytree(prefix / "share/swarmcert", data / "data/share/swarmcert")
        tool = prefix / "bin/swarmcert"
        module = next((root / "swarmcert").glob("_core*.so"))
        bundled = bundled_libraries(tool) | bundled_libraries(module)
        add_program(tool, data / "scripts/swarmcert", "$ORIGIN/../lib/swarmcert")
        # The module lies in lib/python3.N/site-packages/swarmcert.
        add_program(module, module, "$ORIGIN/../../../swarmcert")
        if arguments.gnuplot:
            bundled |= bundled_libraries(arguments.gnuplot)
            add_program(arguments.gnuplot, libraries / "gnuplot", "$ORIGIN")
        for library in sorted(bundled):
            add_program(library, libraries / pathlib.Path(library).name, "$ORIGIN")
        write_metadata(root / f"swarmcert-{arguments.version}.dist-info", arguments.version, tag)
        notices = root / f"swarmcert-{arguments.version}.dist-info/licences"
        shutil.copytree(prefix / "share/doc/swarmcert", notices)
        arguments.output.mkdir(parents=True, exist_ok=True)
        run(sys.executable, "-m", "wheel", "pack", root, "--dest-dir", arguments.output)
    print(arguments.output / f"swarmcert-{arguments.version}-{tag}.whl")


if __name__ == "__main__":
    main()
