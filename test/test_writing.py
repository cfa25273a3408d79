#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What commands leave behind when writing goes wrong: the old file intact or the new one whole, nothing else, and a message.
faults/faults.c makes each of the calls go wrong in turn, in every way; besides full and read-only disks, a limit of the
shell, closed streams, and signals at any moment. --all tries every call in every way, and more moments.
Environment: BUILD_DIR."""
import itertools
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, HERE)
import inputs  # noqa: E402

BUILD = os.environ.get('BUILD_DIR', os.path.join(HERE, '..', 'build'))
BIN, SHIM = os.path.join(BUILD, 'bin'), os.path.join(BUILD, 'test', 'libfaults.so')
ENDING = {'9': signal.SIGKILL, '2': signal.SIGINT, '15': signal.SIGTERM, '1': signal.SIGHUP}
WAYS = ('full', 'broken', 'short', 'again', *ENDING)
ALL = '--all' in sys.argv
count = {'calls': 0, 'kills': 0, 'disks': 0, 'streams': 0}
wrong = []


def check(good, *words):
    if not good:
        wrong.append(' '.join(str(w) for w in words))


def content(path):
    try:
        with open(path, 'rb') as f:
            return f.read()
    except FileNotFoundError:
        return None


def writers(source):
    """(name, command up to the output's name, what it needs behind it)."""
    record = os.path.join(source, 'a.rbf')
    measured = [os.path.join(source, name) for name in ('in0.txt', 'in40.txt')]
    return [('mkrbf', ['mkrbf', '-n', '1', '-l', '8', '-o'], measured), ('rbf2ttree', ['rbf2ttree', '-n', '1', '-g', '3', '-o'], [record]),
            ('rbf2klems', ['rbf2klems', '-n', '1', '-b', 'q', '-o'], [record])]


def run(command, **options):
    return subprocess.run([os.path.join(BIN, command[0]), *command[1:]], capture_output=True, timeout=120, **options)


class Target:
    """A folder with an old file that a command is to replace."""
    OLD = b'old\n' * 1000

    def __init__(self, writer):
        self.name, self.command, self.behind = writer
        self.folder = tempfile.mkdtemp(prefix='rbf-writing-')
        self.path = os.path.join(self.folder, 'out')
        done = run([*self.command, self.path, *self.behind])
        assert done.returncode == 0, done.stderr
        self.new = content(self.path)
        self.reset()

    def reset(self):
        for name in os.listdir(self.folder):
            os.remove(os.path.join(self.folder, name))
        with open(self.path, 'wb') as f:
            f.write(self.OLD)

    def left(self):
        return sorted(set(os.listdir(self.folder)) - {'out'})

    def whole(self):
        return content(self.path) in (self.OLD, self.new)

    def run(self, **options):
        return run([*self.command, self.path, *self.behind], **options)


def each_call(target, named):
    """Every call, every way. Returns how many calls there are."""
    base = dict(os.environ, LD_PRELOAD=SHIM, **({'FAULT_NAMED': '1'} if named else {}))
    counted = os.path.join(target.folder, 'count')
    target.run(env=dict(base, FAULT_AT='0', FAULT_DO='full', FAULT_COUNT=counted))
    calls = int(content(counted))
    check(calls > 5, target.name, 'made', calls, 'calls: is the preloaded library used?')
    for at, way in itertools.product(range(1, calls + 1), WAYS):
        # those at the end, where files get their names, all of them for the quickest command
        thin = 1 if ALL else 3 * len(WAYS) if calls - at > 9 else 1 if target.name == 'rbf2ttree' else 5
        if (at + WAYS.index(way)) % thin:
            continue
        target.reset()
        done = target.run(env=dict(base, FAULT_AT=str(at), FAULT_DO=way))
        said, what = done.stderr.decode(), (target.name, 'named' if named else 'unnamed', f'call {at} of {calls}', way)
        count['kills' if way in ENDING else 'calls'] += 1
        check(target.whole(), *what, 'the file is neither old nor new')
        replaced = content(target.path) == target.new
        if way in ('short', 'again'):
            check(done.returncode == 0 and replaced, *what, 'exit', done.returncode, said)
        elif way in ('full', 'broken'):
            check(done.returncode == (0 if replaced else 1), *what, 'exit', done.returncode, 'replaced' if replaced else 'not replaced', said)
            check(replaced or re.match(f'{target.name}: ', said), *what, 'no message but', repr(said))
        elif way != '9': # one that comes once the file is whole is too late
            check(done.returncode == -ENDING[way] or (replaced and done.returncode == 0), *what, 'exit', done.returncode, said)
        if way == '9': # nobody can clean up
            check(len(target.left()) <= 1 and all(name.startswith('.rbf-') for name in target.left()), *what, 'left', target.left())
        else:
            check(not target.left(), *what, 'left', target.left())
    return calls


def any_moment(target, runs):
    """Signals from outside, at moments over the whole run."""
    start = time.monotonic()
    target.run()
    duration = time.monotonic() - start
    chance = random.Random(5)
    for n in range(runs):
        target.reset()
        number = list(ENDING.values())[n % len(ENDING)]
        child = subprocess.Popen([os.path.join(BIN, target.command[0]), *target.command[1:], target.path, *target.behind],
                                 stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(1.1 * duration * chance.random())
        child.send_signal(number)
        code = child.wait(60)
        count['kills'] += 1
        check(code in (0, -number), target.name, number, 'exit', code)
        check(target.whole() and (code or content(target.path) == target.new), target.name, number, 'the file is neither old nor new')
        check(number == signal.SIGKILL or not target.left(), target.name, number, 'left', target.left())


def refused(target, name, words, **options):
    """A run that must fail with a message, and leave all as it was."""
    done = target.run(**options)
    said = done.stderr.decode()
    count['disks'] += 1
    check(done.returncode == 1 and re.match(f'{target.name}: .*(?:{words})', said), target.name, name, 'exit', done.returncode, said)
    check(content(target.path) == target.OLD and not target.left(), target.name, name, 'the old file is gone, or more was left', target.left())


def limit(bytes):
    def set_limit():
        import resource
        resource.setrlimit(resource.RLIMIT_FSIZE, (bytes, bytes))
    return set_limit


def disks(targets):
    """Real ones: as root in a mount namespace of our own, as others a folder without the right to write."""
    for target in targets:
        for bytes in (0, 1, 100, len(target.new) // 2, len(target.new) - 1) if ALL else (0, len(target.new) - 1):
            target.reset()
            refused(target, f'limit of {bytes} bytes', 'File too large', preexec_fn=limit(bytes))
    if os.geteuid():
        for target in targets:
            target.reset()
            os.chmod(target.folder, 0o555)
            refused(target, 'read-only folder', 'cannot write')
            os.chmod(target.folder, 0o755)
        return
    inside = [sys.executable, os.path.abspath(__file__), '--mounts', *(['--all'] if ALL else []), *(t.path for t in targets)]
    done = subprocess.run(['unshare', '-m', *inside], capture_output=True, text=True)
    if done.returncode == 77 or 'unshare:' in done.stderr:
        print('not tried: full and read-only disks, since nothing can be mounted here')
        return
    check(done.returncode == 0, done.stdout, done.stderr)
    count['disks'] += int(re.search(r'(\d+) disks', done.stdout + ' 0 disks').group(1))


def mounts(targets):
    """In the namespace."""
    for target in targets:
        room = 4096 * (1 + len(target.OLD) // 4096)
        for free in range(0, len(target.new), 4096 if ALL else 1 + len(target.new) // 2):
            if subprocess.run(['mount', '-t', 'tmpfs', '-o', f'size={room + free // 4096 * 4096}', 'tmpfs', target.folder], capture_output=True).returncode:
                sys.exit(77)
            target.reset()
            refused(target, f'disk with {free} bytes', 'No space left')
            subprocess.run(['mount', '-o', 'remount,ro', target.folder], check=True)
            refused(target, 'read-only disk', 'Read-only|cannot write')
            subprocess.run(['umount', target.folder], check=True)


def closed(*files):
    def close():
        for file in files:
            os.close(file)
    return close


def streams(targets, source):
    """Standard streams that are full, closed, or pipes that nobody reads."""
    record = os.path.join(source, 'a.rbf')
    pair = {'input': b'0 .5 .8  0 -.5 .8\n' * 3}
    printing = [(['rbf2ttree', '-g', '3', record], {}), (['rbf2klems', '-b', 'q', record], {}), (['rbfreport', record], {}), (['rbfinfo', record], {}),
                (['rbfquery', record], pair), (['rbfquery', '-d', record], pair), (['rbfquery', '-s', '3', record], pair)]
    printing += [([name, option], {}) for name in ('mkrbf', 'rbfinfo') for option in ('--help', '--version')]
    for command, options in printing:
        command = [os.path.join(BIN, command[0]), *command[1:]]
        name = os.path.basename(command[0])

        def fails(what, codes, stdout, **more):
            options_now = dict(options, **more)
            done = subprocess.run(command, stdout=stdout, stderr=subprocess.PIPE, timeout=60, **options_now)
            count['streams'] += 1
            said = done.stderr.decode()
            check(done.returncode in codes, *command, what, 'exit', done.returncode, said)
            check(done.returncode < 0 or re.match(f'{name}: standard output: ', said), *command, what, 'said', repr(said))
        with open('/dev/full', 'wb') as full:
            fails('full', (1,), full)
        fails('closed', (1,), None, preexec_fn=closed(1))
        for ignored, codes in ((False, (-signal.SIGPIPE,)), (True, (1,))):
            reading, writing = os.pipe()
            os.close(reading)
            fails('unread', codes, writing, restore_signals=not ignored)
            os.close(writing)
    for target in targets: # messages must not land in the file, which would get a closed stream's number
        for files in ((2,), (1, 2), (0, 1, 2)):
            target.reset()
            done = subprocess.run([os.path.join(BIN, target.command[0]), '-p60', *target.command[1:], target.path, *target.behind],
                                  preexec_fn=closed(*files), timeout=60, env=dict(os.environ, LD_PRELOAD=SHIM, FAULT_STREAMS='1'))
            count['streams'] += 1
            found = content(target.path)
            same = found == target.new if target.name == 'mkrbf' else found.split(b'-->')[1:] == target.new.split(b'-->')[1:]
            check(done.returncode == 0 and same, target.name, 'without streams', files, 'exit', done.returncode, 'same file' if same else 'another file')


def main():
    source = tempfile.mkdtemp(prefix='rbf-writing-')
    try:
        for theta in (0, 40):
            with open(os.path.join(source, f'in{theta}.txt'), 'w') as f:
                f.write(inputs.measured(theta))
        done = run([*writers(source)[0][1], os.path.join(source, 'a.rbf'), *writers(source)[0][2]])
        assert done.returncode == 0, done.stderr
        targets = [Target(w) for w in writers(source)]
        streams(targets, source)
        disks(targets)
        for target in targets:
            for named in (False, True):
                each_call(target, named)
            any_moment(target, 200 if ALL else 8)
        for target in targets:
            shutil.rmtree(target.folder)
    finally:
        shutil.rmtree(source)
    print('\n'.join(wrong[:30]))
    print(', '.join(f'{n} {name}' for name, n in count.items()), f'and {len(wrong)} findings')
    return bool(wrong)


def main_in_mounts():
    """The outputs are given; their folders are mount points here."""
    paths = [a for a in sys.argv[1:] if not a.startswith('--')]
    with tempfile.TemporaryDirectory(prefix='rbf-writing-') as source:
        for theta in (0, 40):
            with open(os.path.join(source, f'in{theta}.txt'), 'w') as f:
                f.write(inputs.measured(theta))
        run([*writers(source)[0][1], os.path.join(source, 'a.rbf'), *writers(source)[0][2]])
        targets = []
        for writer, path in zip(writers(source), paths):
            target = Target(writer)
            shutil.rmtree(target.folder)
            target.folder, target.path = os.path.dirname(path), path
            targets.append(target)
        mounts(targets)
    print('\n'.join(wrong[:30]))
    print(f'{count["disks"]} disks')
    return bool(wrong)


if __name__ == '__main__':
    sys.exit(main_in_mounts() if '--mounts' in sys.argv else main())
