"""Compilation and its disk cache, with a tiny package of kernels and one process for each run of it."""

import ast
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import dirt_env
from dirt_env.sim import intrinsics, jit, lanes

pytestmark = pytest.mark.slow

PACKAGE = Path(dirt_env.__file__).parent
LAW = """
from plough.sim.jit import kernel

@kernel
def thrust(weight):
    return 2.0 * weight
"""
ADVANCE = """
from plough.sim.jit import entry
from plough.sim.laws import thrust

@entry
def total(weights):
    sum_ = 0.0
    for weight in weights:
        sum_ += thrust(weight)
    return sum_

@entry
def ratio(a, b):
    return a / b

@entry
def fails(a):
    return a.no_such_attribute

def variant(law, twice):
    @entry
    def sum_(weights):
        sum_ = 0.0
        for weight in weights:
            sum_ += law(weight) if twice else weight
        return sum_

    return sum_
"""
PRELUDE = """
import json, sys
import numpy as np
from plough.sim import advance, jit

def report(function, *arguments):
    value = function(*arguments)
    print(json.dumps([value, sum(function.stats.cache_misses.values())]))
"""
TOTAL = "report(advance.total, np.ones(3))"
LOCKS_ARE_FREE = """
import fcntl
locks = list(jit.cache_root().rglob("*.lock"))
assert locks
for lock in locks:
    with open(lock) as handle:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
"""


class Plough:
    """A package with a law and an entry in different modules, and its cache directory."""

    def __init__(self, root: Path) -> None:
        self.cache = root / "cache"
        self._root = root
        sim = root / "plough" / "sim"
        sim.mkdir(parents=True)
        (sim.parent / "__init__.py").touch()
        (sim / "__init__.py").touch()
        shutil.copy(jit.__file__, sim)
        self.law = sim / "laws.py"
        self.law.write_text(LAW)
        (sim / "advance.py").write_text(ADVANCE)

    def start(self, code: str, **environment: str) -> subprocess.Popen:
        variables = os.environ | {"DIRT_ENV_CACHE_DIR": str(self.cache), "NUMBA_DISABLE_JIT": "0"} | environment
        variables["PYTHONPATH"] = str(self._root)
        return subprocess.Popen(
            [sys.executable, "-c", PRELUDE + code], env=variables, cwd=self._root, stdout=subprocess.PIPE, text=True
        )

    def run(self, code: str, **environment: str) -> list[list[float]]:
        """What `code` reported, one [value, number of compilations] for each call."""
        return _reports(self.start(code, **environment))

    def kernels(self) -> list[Path]:
        return sorted(self.cache.rglob("*.kernel"))


def _reports(process: subprocess.Popen) -> list[list[float]]:
    output, _ = process.communicate(timeout=120)
    assert process.returncode == 0
    return [json.loads(line) for line in output.splitlines()]


@pytest.fixture
def plough(tmp_path):
    return Plough(tmp_path)


def test_the_second_process_compiles_nothing(plough):
    assert plough.run(TOTAL) == [[6.0, 1]]
    assert plough.run(TOTAL) == [[6.0, 0]]
    assert not list(plough.cache.rglob("*.draft"))


def test_editing_a_law_in_another_module_changes_the_result(plough):
    plough.run(TOTAL)
    plough.law.write_text(LAW.replace("2.0", "5.00"))
    assert plough.run(TOTAL) == [[15.0, 1]]


def test_what_was_edited_while_a_process_ran_is_not_mixed_up_with_what_it_runs(plough):
    edited = LAW.replace("2.0", "5.00")  # of another length, for Python itself tells versions by second and length
    code = f"""
open({str(plough.law)!r}, "w").write({edited!r})
from importlib import reload
reload(advance)
{TOTAL}
"""
    assert plough.run(code) == [[6.0, 1]]
    assert not plough.kernels()
    assert plough.run(TOTAL) == [[15.0, 1]]


def test_variants_of_a_closure_are_kept_apart_and_found_again(plough):
    code = "for twice in (True, False):\n    report(advance.variant(advance.thrust, twice), np.ones(3))"
    assert plough.run(code) == [[6.0, 1], [3.0, 1]]
    assert plough.run(code) == [[6.0, 0], [3.0, 0]]


def test_a_truncated_or_altered_file_is_compiled_again_and_replaced(plough):
    plough.run(TOTAL)
    [file] = plough.kernels()
    sound = file.read_bytes()
    damaged = [b"", sound[:10], sound[: len(sound) // 2], sound[:-1], sound[:-9] + b"x" + sound[-8:]]
    code = "from importlib import reload\nfrom pathlib import Path\n"
    for content in damaged:
        name = f"damaged-{len(content)}-{hash(content)}"
        (plough.cache / name).write_bytes(content)
        code += f"Path({str(file)!r}).write_bytes(Path({str(plough.cache / name)!r}).read_bytes())\n"
        code += f"reload(advance)\n{TOTAL}\nreload(advance)\n{TOTAL}\n"
    assert plough.run(code) == [[6.0, 1], [6.0, 0]] * len(damaged)


@pytest.mark.parametrize("variable", ["DIRT_ENV_CACHE_DIR", "XDG_CACHE_HOME", "HOME"])
def test_without_a_writable_directory_it_does_without_a_cache(plough, tmp_path, variable):
    (tmp_path / "file").touch()  # a directory below a file cannot be made, not even by root
    environment = {"DIRT_ENV_CACHE_DIR": "", "XDG_CACHE_HOME": "", "LOCALAPPDATA": ""}
    environment[variable] = str(tmp_path / "file" / "below")
    assert plough.run(TOTAL, **environment) == [[6.0, 1]]


def test_a_full_disk_is_no_error(plough):
    fails = "def replace(*paths):\n    raise OSError(28, 'No space left on device')\njit.os.replace = replace\n"
    assert plough.run(fails + TOTAL) == [[6.0, 1]]
    assert not plough.kernels()
    assert not list(plough.cache.rglob("*.draft"))


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="permissions of POSIX")
def test_a_directory_that_others_may_write_to_is_not_used(plough):
    plough.run(TOTAL)
    [file] = plough.kernels()
    assert file.parent.stat().st_mode & 0o077 == 0
    file.parent.chmod(0o777)
    assert plough.run(TOTAL) == [[6.0, 1]]


@pytest.mark.skipif(sys.platform == "win32", reason="no file locks there")
def test_of_many_cold_processes_one_compiles(plough):
    reports = [_reports(process)[0] for process in [plough.start(TOTAL) for _ in range(4)]]
    assert [value for value, _ in reports] == [6.0] * 4
    assert sum(compiled for _, compiled in reports) == 1


ASIDE = "jit.compile_aside(advance.total, np.ones(3))\n"
STARTED = f"""
import subprocess
start, started = subprocess.Popen, []
subprocess.Popen = lambda *arguments, **options: started.append(start(*arguments, **options)) or started[-1]
{ASIDE}
"""


def test_a_process_of_its_own_compiles_what_this_one_waits_for(plough):
    assert plough.run(ASIDE + TOTAL + LOCKS_ARE_FREE) == [[6.0, 0]]
    assert len(plough.kernels()) == 1


def test_machine_code_leaves_no_process_behind(plough):
    code = """
code = jit.machine_code(advance.total, np.ones(3))
print(json.dumps([code(np.ones(3)), len(jit._HELPERS)]))
assert started[0].returncode is not None
"""
    assert plough.run(STARTED + code) == [[6.0, 0]]


@pytest.mark.parametrize("asked_before", [TOTAL, ASIDE])
def test_no_process_is_started_for_what_is_there_or_under_way(plough, asked_before):
    assert plough.run(asked_before + STARTED + "print(json.dumps(len(started)))")[-1] == 0


def test_of_many_cold_processes_one_has_it_compiled_aside(plough):
    processes = [plough.start(STARTED + TOTAL + "\nprint(json.dumps(len(started)))") for _ in range(4)]
    reports = [_reports(process) for process in processes]
    assert [report[0] for report in reports] == [[6.0, 0]] * 4
    assert sum(report[1] for report in reports) == 1


@pytest.mark.parametrize(
    "broken",
    [
        "sys.executable = '/nowhere/python'",
        "sys.executable = ''",
        "sys.executable = '/bin/true'",
        "jit._HELPER = 'import sys; sys.exit(1)'",
        "jit._HELPER = 'import sys; sys.stdin.close(); sys.exit(1)'",
        "advance.total.__name__ = 'no_such_entry'",
    ],
)
def test_where_a_process_cannot_compile_this_one_does(plough, broken):
    assert plough.run(f"{broken}\n{ASIDE}{TOTAL}{LOCKS_ARE_FREE}") == [[6.0, 1]]


def test_a_process_that_is_killed_in_the_middle_is_not_waited_for(plough):
    code = f"""
jit._HELPER = "import time; time.sleep(600)"
{ASIDE}
import threading
threading.Timer(1.0, next(iter(jit._HELPERS.values())).kill).start()
"""
    assert plough.run(code + TOTAL + LOCKS_ARE_FREE) == [[6.0, 1]]


def test_where_there_is_no_room_for_the_code_nothing_is_compiled_aside(plough):
    full = "import resource\nresource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))\n"
    assert plough.run(full + STARTED + TOTAL + "\nprint(json.dumps(len(started)))") == [[6.0, 1], 0]
    assert plough.run(STARTED + TOTAL + "\nprint(json.dumps(len(started)))") == [[6.0, 0], 1]


def test_what_cannot_be_sent_to_a_process_is_compiled_here(plough):
    code = f"sys.path.append(lambda: None)\n{STARTED}sys.path.pop()\n{TOTAL}\nprint(json.dumps(len(started)))"
    assert plough.run(code + LOCKS_ARE_FREE) == [[6.0, 1], 0]


def test_two_signatures_are_compiled_aside_side_by_side(plough):
    both = "jit.compile_aside(advance.total, np.ones(3, np.float32))\nassert len(jit._HELPERS) == 2\n"
    first = (
        "print(json.dumps(jit.machine_code(advance.total, np.ones(3))(np.ones(3))))\nassert len(jit._HELPERS) == 1\n"
    )
    other = "report(advance.total, np.ones(3, np.float32))"
    assert plough.run(ASIDE + both + first + other) == [6.0, [6.0, 0]]


def test_with_standard_input_closed_the_lock_is_kept(plough):
    assert plough.run("import os\nos.close(0)\n" + STARTED + TOTAL) == [[6.0, 0]]


def test_a_process_that_ends_takes_the_one_that_it_started_along(plough):
    code = "jit._HELPER = 'import time; time.sleep(600)'\n" + STARTED + "print(json.dumps(started[0].pid))"
    (pid,) = plough.run(code)
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)


def test_a_kernel_may_have_a_comprehension(plough):
    code = """
from plough.sim.jit import entry, kernel

@kernel
def doubled(weights):
    return sum([2.0 * weight for weight in weights])

@entry
def of(weights):
    return doubled(weights)

report(of, np.ones(3))
"""
    assert plough.run(code)[0][0] == 6.0


def test_without_a_cache_nothing_is_compiled_aside(plough):
    count = "print(json.dumps(len(started)))"
    assert plough.run(STARTED + count, DIRT_ENV_CACHE_DIR="/dev/null/cache") == [0]
    assert plough.run(STARTED + count, NUMBA_DISABLE_JIT="1") == [0]
    edited = f"""
open({str(plough.law)!r}, "a").write("# edited")
from importlib import reload
reload(advance)
{STARTED}
{TOTAL}
{count}
"""
    assert plough.run(edited) == [[6.0, 1], 0]


def test_what_has_been_compiled_here_is_not_compiled_aside(plough):
    code = TOTAL + "\nimport shutil\nshutil.rmtree(jit.cache_root())" + STARTED + "print(json.dumps(len(started)))"
    assert plough.run(code) == [[6.0, 1], 0]


def test_what_lies_in_the_folder_at_hand_is_not_imported(plough):
    code = """
import os
os.mkdir("other")
os.chdir("other")
open("pickle.py", "w").write("raise SystemExit")
"""
    assert plough.run(code + ASIDE + TOTAL) == [[6.0, 0]]


@pytest.mark.skipif(sys.platform == "win32", reason="no file locks there")
def test_threads_and_failed_compilations_leave_no_lock_behind(plough):
    code = """
from concurrent.futures import ThreadPoolExecutor
with ThreadPoolExecutor() as pool:
    arguments = [np.ones(3), np.ones(3, np.float32), np.ones(3, np.int64), np.ones(6)[::2]]
    assert list(pool.map(advance.total, arguments)) == [6.0] * 4
try:
    advance.fails(1.0)
except jit.numba.TypingError:
    pass
"""
    plough.run(code + LOCKS_ARE_FREE)
    assert len(plough.kernels()) == 4


def test_garbage_is_looked_for_less_often_while_numba_compiles_and_no_longer(plough):
    code = """
import gc
from numba.core import event

seen = []
class Listener(event.Listener):
    def on_start(self, event):
        seen.append(gc.get_threshold()[0])
    def on_end(self, event):
        pass

event.register("numba:compile", Listener())
before = gc.get_threshold()
advance.total(np.ones(3))
assert min(seen) > before[0] and gc.get_threshold() == before
try:
    advance.fails(1.0)
except jit.numba.TypingError:
    assert gc.get_threshold() == before
gc.set_threshold(0)  # somebody wants none at all
seen.clear()
advance.total(np.ones(3, np.float32))
assert set(seen) == {0} and gc.get_threshold()[0] == 0
"""
    plough.run(code)


def test_what_is_called_with_constants_is_compiled_once_for_all_of_them(plough):
    code = """
from numba.core import event
from plough.sim.jit import entry, kernel

@kernel
def share(weight, parts, marks):
    return weight / parts if marks[1] else weight

@entry
def shares(weight):
    return share(weight, 2, (0, True)) + share(weight, 4, (1, True)) + share(weight, 1, (2, False))

with event.install_recorder("numba:compile") as compiled:
    found = shares(8.0)
names = [one.data["dispatcher"].py_func.__name__ for _, one in compiled.buffer if one.is_start]
print(json.dumps([found, names.count("share"), names.count("shares")]))
"""
    assert plough.run(code) == [[8 / 2 + 8 / 4 + 8, 1, 1]]


def test_division_by_zero_is_numpys(plough):
    assert plough.run("assert advance.ratio(1.0, 0.0) == np.inf and np.isnan(advance.ratio(0.0, 0.0))") == []


def test_without_compilation_the_functions_are_plain_python(plough):
    code = "assert type(advance.total) is type(report)\nassert advance.total(np.ones(3)) == 6.0"
    assert plough.run(code, NUMBA_DISABLE_JIT="1") == []
    assert not plough.cache.exists()


def test_versions_that_nothing_was_compiled_for_in_a_month_are_removed(plough):
    for name, age in {"old": 40, "young": 2}.items():
        (plough.cache / name).mkdir(parents=True)
        then = (plough.cache.stat().st_mtime) - age * 86400
        os.utime(plough.cache / name, (then, then))
    plough.run(TOTAL)
    assert not (plough.cache / "old").exists()
    assert (plough.cache / "young").exists()


def _trees(root: Path):
    return {path: ast.parse(path.read_text()) for path in sorted(root.rglob("*.py"))}


def _imports(tree: ast.AST):
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (name.name for name in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from (f"{node.module}.{name.name}" for name in node.names)


def test_no_kernel_uses_fast_maths_or_numbas_threads():
    for path, tree in _trees(PACKAGE).items():
        names = {node.arg for node in ast.walk(tree) if isinstance(node, ast.keyword)}
        assert not names & {"fastmath", "parallel"}, path
        assert "numba.prange" not in _imports(tree), path


def test_numba_is_imported_where_kernels_are_made_only():
    using = {path for path, tree in _trees(PACKAGE).items() if any(n.split(".")[0] == "numba" for n in _imports(tree))}
    assert using == {Path(module.__file__) for module in (jit, intrinsics, lanes)}


def test_every_file_with_kernels_is_part_of_the_digest():
    for path, tree in _trees(PACKAGE).items():
        if {"dirt_env.sim.jit.kernel", "dirt_env.sim.jit.entry"} & set(_imports(tree)):
            assert path.relative_to(PACKAGE).parts[0] in jit.KERNEL_PACKAGES, path
