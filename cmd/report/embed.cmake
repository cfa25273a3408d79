# SPDX-License-Identifier: BSD-3-Clause
# cmake -DOUTPUT=page.c -DFOLDER=... -P embed.cmake: page.html, page.css and page.js as C arrays that end with a 0.
set(TEXT "/* made by embed.cmake */\n#include \"page.h\"\n")
foreach(KIND html css js)
	file(READ "${FOLDER}/page.${KIND}" BYTES HEX)
	string(REGEX REPLACE "(..)" "0x\\1," BYTES "${BYTES}")
	string(REGEX REPLACE "(................................................................................)" "\\1\n" BYTES "${BYTES}")
	string(APPEND TEXT "const char report_${KIND}[] = {\n${BYTES}0};\n")
endforeach()
file(WRITE "${OUTPUT}" "${TEXT}")
