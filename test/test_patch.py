#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The patch tool on miniature trees of both layouts: what it adds, that it can be repeated and taken back, and that
it changes nothing where a place is missing. The fixtures hold only what the tool looks for. A real source tree is
tried as well, if the build unpacked one."""
import glob
import os
import shutil
import subprocess
import sys
import tempfile
import unittest

SOURCE = os.environ.get("SOURCE_DIR", os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
BUILD = os.environ.get("BUILD_DIR", os.path.join(SOURCE, "build"))
PATCH = os.path.join(SOURCE, "radiance-patch", "patch")

BSDF_C = b"""#include "other.h"
#include "bsdf_t.h"

static SDError SDloadFileLater(void);

SDError
SDloadFile(SDData *sd, const char *fname)
{
\tSDfreeBSDF(sd);
\ttree = ezxml_parse_file(fname);
\tif (tree == NULL) {
\t\treturn SDEfile;
\t}
\tSDfreeBSDF(sd);
}

void
SDfreeBSDF(SDData *sd)
{
}
"""
CMAKE = b"""set(rtrad_SOURCES
  bsdf.c
  bsdf_t.c
)
add_library(rtrad ${rtrad_SOURCES})
target_link_libraries(rtrad ${LIB_M})
"""
RMAKEFILE = b"""UTLOBJ = ezxml.o bsdf.o bsdf_t.o \\
\tloadbsdf.o

all:\tlib.a

loadbsdf.o:\tbsdf.h
"""
SCONSCRIPT = b"""RTCONT = Split('''bsdf.c bsdf_t.c
\t\tloadbsdf.c''')
objs = RTCONT
"""
CRAY_CMAKE = b"""set(rtrad_SOURCES
        bsdf.c bsdf_t.c
        )
add_library(rtrad STATIC ${rtrad_SOURCES})
add_library(rtrad2 STATIC other.c)
"""
# layout: {path: content}
LAYOUTS = {
    "6.1": {"src/common/bsdf.c": BSDF_C, "src/common/CMakeLists.txt": CMAKE, "src/common/Rmakefile": RMAKEFILE,
            "src/common/SConscript": SCONSCRIPT, "src/rt/VERSION": b"RADIANCE 6.1\n", "src/rt/rtmain.c": b"int x;\n"},
    "5.4": {"src/CMakeLists.txt": CRAY_CMAKE, "src/Radiance/src/common/bsdf.c": BSDF_C,
            "src/Radiance/src/rt/VERSION": b"RADIANCE 5.4a\n"},
}
# every place the tool needs: (layout, file, text that marks it)
ANCHORS = [("6.1", "src/common/bsdf.c", b'#include "bsdf_t.h"'), ("6.1", "src/common/bsdf.c", b"SDloadFile(SDData"),
           ("6.1", "src/common/bsdf.c", b"ezxml_parse_file"), ("6.1", "src/common/bsdf.c", b"\tSDfreeBSDF(sd);\n\ttree"),
           ("6.1", "src/common/CMakeLists.txt", b"add_library(rtrad "), ("6.1", "src/common/Rmakefile", b"UTLOBJ"),
           ("6.1", "src/common/Rmakefile", b"bsdf_t.o"), ("6.1", "src/common/Rmakefile", b"loadbsdf.o:"),
           ("6.1", "src/common/SConscript", b"RTCONT"), ("6.1", "src/common/SConscript", b"bsdf_t.c"),
           ("5.4", "src/CMakeLists.txt", b"add_library(rtrad STATIC"), ("5.4", "src/Radiance/src/common/bsdf.c", b"fname)")]


def patch(*arguments):
    return subprocess.run([sys.executable, PATCH, *arguments], capture_output=True, text=True)


def snapshot(folder):
    """{path: (content, time, mode)} of all files."""
    result = {}
    for place, _, names in os.walk(folder):
        for name in names:
            path = os.path.join(place, name)
            with open(path, "rb") as file:
                state = os.stat(path)
                result[os.path.relpath(path, folder)] = file.read(), state.st_mtime_ns, state.st_mode
    return result


def contents(folder):
    return {path: (data, mode) for path, (data, _, mode) in snapshot(folder).items()}


class PatchTest(unittest.TestCase):
    def setUp(self):
        self.root = tempfile.mkdtemp(prefix="rbf-patch-")
        self.addCleanup(shutil.rmtree, self.root)

    def tree(self, layout, change=lambda path, data: data):
        root = os.path.join(self.root, "tree")
        shutil.rmtree(root, ignore_errors=True)
        for path, data in LAYOUTS[layout].items():
            full = os.path.join(root, path)
            os.makedirs(os.path.dirname(full), exist_ok=True)
            with open(full, "wb") as file:
                file.write(change(path, data))
        return root

    def refused(self, root, word):
        before = snapshot(root)
        for command in ("apply", "check"):
            run = patch(command, root)
            self.assertEqual(run.returncode, 2, run)
            self.assertIn("refused, nothing was changed", run.stderr)
            self.assertIn(word, run.stderr)
        self.assertEqual(before, snapshot(root))

    def round_trip(self, root, edited, folder="src/common"):
        before = contents(root)
        self.assertEqual(patch("check", root).returncode, 1)
        run = patch("apply", root)
        self.assertEqual(run.returncode, 0, run)
        after = snapshot(root)
        self.assertEqual(patch("check", root).returncode, 0)
        for path in before:
            self.assertEqual(path in edited, after[path][0] != before[path][0], path)
            self.assertEqual(after[path][2], before[path][1], path)
            lines, inside = [], False
            for line in after[path][0].splitlines(keepends=True):
                inside = inside or b"added by radiance-patch" in line
                if not inside:
                    lines.append(line)
                if b"bsdfrbf: end" in line:
                    inside = False
            self.assertEqual(b"".join(lines), before[path][0], path)
        new = {os.path.join(folder, name) for name in (
            "bsdf_rbf.c", "bsdf_rbf_form.c", "bsdf_rbf_through.c", "bsdf_rbf.h", "bsdf_rbf_part.h", "bsdfrbf.h")}
        self.assertEqual(set(after) - set(before), new)
        self.assertEqual(patch("apply", root).returncode, 0)
        self.assertEqual(after, snapshot(root), "applying twice is the same as once, and rewrites nothing")
        for _ in range(2):
            self.assertEqual(patch("remove", root).returncode, 0)
            self.assertEqual(before, contents(root))

    def test_layouts(self):
        self.round_trip(self.tree("6.1"), {"src/common/" + name for name in (
            "bsdf.c", "CMakeLists.txt", "Rmakefile", "SConscript")})
        cray = {"src/CMakeLists.txt", "src/Radiance/src/common/bsdf.c"}
        self.round_trip(self.tree("5.4"), cray, "src/Radiance/src/common")

    def test_inner_folder(self):
        root = self.tree("5.4")
        before = contents(root)
        self.assertEqual(patch("apply", os.path.join(root, "src", "Radiance")).returncode, 0)
        self.assertEqual(patch("check", root).returncode, 0)
        self.assertEqual(patch("remove", os.path.join(root, "src", "Radiance")).returncode, 0)
        self.assertEqual(before, contents(root))

    def test_place_in_function(self):
        root = self.tree("6.1")
        patch("apply", root)
        with open(os.path.join(root, "src/common/bsdf.c")) as file:
            text = file.read()
        self.assertEqual(text.count("SDloadRbf(&rbf_error, sd, &fname)"), 1)
        self.assertLess(text.index("SDfreeBSDF(sd)"), text.index("SDloadRbf"))
        self.assertLess(text.index("SDloadRbf"), text.index("ezxml_parse_file"))

    def test_carriage_returns_and_mode(self):
        root = self.tree("6.1", lambda path, data: data.replace(b"\n", b"\r\n"))
        os.chmod(os.path.join(root, "src/common/bsdf.c"), 0o444)
        self.round_trip(root, {"src/common/" + name for name in ("bsdf.c", "CMakeLists.txt", "Rmakefile", "SConscript")})

    def test_missing_or_ambiguous_place(self):
        for layout, file, anchor in ANCHORS:
            with self.subTest(file=file, anchor=anchor):
                self.refused(self.tree(layout, lambda path, data: data.replace(anchor, b"x", 1) if path == file else data),
                             os.path.basename(file))
        for file, line in (("src/common/bsdf.c", b'#include "bsdf_t.h"\n'), ("src/common/SConscript", b"RTCONT = Split('')\n"),
                           ("src/common/CMakeLists.txt", b"add_library(rtrad ${rtrad_SOURCES})\n")):
            with self.subTest(twice=line):
                self.refused(self.tree("6.1", lambda path, data: data + line if path == file else data), "2 times")

    def test_not_a_tree(self):
        self.refused(self.root, "not a Radiance source tree")
        self.assertEqual(patch("apply", os.path.join(self.root, "none")).returncode, 2)
        for bad in ((), ("apply",), ("apply", "a", "b"), ("what", "a")):
            self.assertEqual(patch(*bad).returncode, 2)

    def test_strange_files(self):
        root = self.tree("6.1")
        with open(os.path.join(root, "src/common/bsdf_rbf.c"), "w") as file:
            file.write("/* another author's */\n")
        before = snapshot(root)
        self.assertEqual(patch("apply", root).returncode, 2)
        self.assertEqual(before, snapshot(root))
        self.assertEqual(patch("remove", root).returncode, 0)
        self.assertEqual(before, snapshot(root))

    def test_edited_block(self):
        root = self.tree("6.1")
        patch("apply", root)
        path = os.path.join(root, "src/common/bsdf.c")
        with open(path, "rb") as file:
            text = file.read()
        older = text.replace(b"return rbf_error;", b"return SDloadOld(sd);")
        with open(path, "wb") as file:
            file.write(older)
        self.assertEqual(patch("check", root).returncode, 1)
        self.assertEqual(patch("apply", root).returncode, 0)
        with open(path, "rb") as file:
            self.assertEqual(text, file.read(), "an older version of our lines is replaced")
        with open(path, "wb") as file:
            file.write(text.replace(b"/* bsdfrbf: end */\n", b""))
        self.refused(root, "no end")

    def test_no_build_list(self):
        root = self.tree("6.1")
        for name in ("CMakeLists.txt", "Rmakefile", "SConscript"):
            os.unlink(os.path.join(root, "src/common", name))
        run = patch("apply", root)
        self.assertEqual(run.returncode, 0)
        self.assertIn("no build list", run.stdout)

    def test_export(self):
        root, copy = self.tree("6.1"), os.path.join(self.root, "copy")
        before = snapshot(root)
        self.assertEqual(patch("export", root, copy).returncode, 0)
        self.assertEqual(before, snapshot(root), "the original stays as it is")
        first = snapshot(copy)
        self.assertIn(b"SDloadRbf", first["common/bsdf.c"][0])
        self.assertIn("rt/VERSION", first)
        self.assertEqual(patch("export", root, copy).returncode, 0)
        self.assertEqual(first, snapshot(copy), "nothing is rewritten")
        os.rename(os.path.join(root, "src/rt/rtmain.c"), os.path.join(root, "src/rt/new.c"))
        patch("export", root, copy)
        self.assertEqual(set(snapshot(copy)) ^ set(first), {"rt/rtmain.c", "rt/new.c"})

    def test_real_tree(self):
        found = glob.glob(os.path.join(BUILD, "source", "craytraverse-*", "src", "Radiance", "src", "common", "bsdf.c"))
        if not found:
            self.skipTest("no Radiance sources were unpacked")
        root = os.path.join(self.root, "real")
        shutil.copytree(os.path.join(os.path.dirname(found[0]), "..", "..", ".."), os.path.join(root, "src"))
        self.round_trip(root, {"src/CMakeLists.txt", "src/Radiance/src/common/bsdf.c"}, "src/Radiance/src/common")


if __name__ == "__main__":
    unittest.main(verbosity=2)
