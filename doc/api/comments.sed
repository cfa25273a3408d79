# SPDX-License-Identifier: BSD-3-Clause
# bsdfrbf.h is written in plain C comments; this marks them for Doxygen.
/^\/\* SPDX/d
/^\/\* ---/d
s,^/\*$,/** @mainpage\nAll is in bsdfrbf.h. */\n/** @file\n@verbatim,
s,^ \*/$,@endverbatim */,
s,^/\* ,/** ,
s,^ \* \{0\,1\},,
s,^\t\([^/].*\S\)  *\/\* ,\t\1 /**< ,
