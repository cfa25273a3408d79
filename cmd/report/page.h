/* SPDX-License-Identifier: BSD-3-Clause */
/* The page's text; the arrays are made from page.html, page.css and page.js when the project is built (embed.cmake). */
#ifndef REPORT_PAGE_H
#define REPORT_PAGE_H

extern const char report_html[]; /* with @CSS@, @DATA@ and @JS@ where the others and the data go, in this order */
extern const char report_css[];
extern const char report_js[];
#endif
