/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * man2help page.1 help.c: what --help prints, from the manual page, so that both have the same words. Takes the
 * synopsis, the first paragraph of DESCRIPTION and the first sentence about each option; knows the few requests that the
 * manual pages here use.
 */
#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { TEXT = 4096, WIDTH = 100, TAG = 14 };

typedef struct page {
	char name[64];
	char synopsis[TEXT], description[TEXT];
	char help[8 * TEXT];
} page;

static void fail(const char *path, int line, const char *text)
{
	fprintf(stderr, "%s:%d: %s\n", path, line, text);
	exit(1);
}

/* Escapes: \- is a dash, \fX and \& are nothing. */
static void unescape(char *text)
{
	char *to = text;
	for (const char *at = text; *at; at++)
		if (at[0] == '\\' && at[1] == 'f' && at[2])
			at += 2;
		else if (at[0] == '\\' && at[1] == '&')
			at++;
		else if (at[0] == '\\' && at[1])
			*to++ = *++at;
		else
			*to++ = *at;
	*to = 0;
}

/* The words of a font request: alternating ones (.BR and so on) follow each other without space. */
static void words(char *arguments, int joined, char *out)
{
	char *at = arguments, *to = out;
	for (int n = 0; *at; n++) {
		while (*at == ' ')
			at++;
		if (!*at)
			break;
		if (n && !joined)
			*to++ = ' ';
		if (*at == '"') {
			for (at++; *at && *at != '"'; at++)
				*to++ = *at;
			at += *at == '"';
		} else
			while (*at && *at != ' ')
				*to++ = *at++;
	}
	*to = 0;
	unescape(out);
}

static void append(char *text, size_t room, const char *more)
{
	if (strlen(text) + strlen(more) + 2 > room) {
		fprintf(stderr, "man2help: a text is too long: %.60s\n", text);
		exit(1);
	}
	if (*text && *more)
		strcat(text, " ");
	strcat(text, more);
}

/* Ends a text behind its first sentence. */
static void first_sentence(char *text)
{
	for (char *at = text; *at; at++)
		if (*at == '.' && at[1] == ' ' && (isupper((unsigned char)at[2]) || at[2] == '-' || at[2] == '(')) {
			at[1] = 0;
			return;
		}
}

/* Adds `text` in lines of at most WIDTH characters, `column` of which are already there. */
static void wrap(page *p, const char *text, size_t column, size_t indent)
{
	char *to = p->help + strlen(p->help);
	for (const char *at = text; *at;) {
		const size_t word = strcspn(at, " ");
		if (column + word > WIDTH && column > indent) {
			to += sprintf(to, "\n%*s", (int)indent, "");
			column = indent;
		}
		if ((size_t)(to - p->help) + word + WIDTH > sizeof p->help)
			fail(p->name, 0, "the help is too long");
		memcpy(to, at, word);
		to += word;
		column += word + 1;
		at += word;
		while (*at == ' ')
			at++;
		if (*at)
			*to++ = ' ';
	}
	strcpy(to, "\n");
	/* no blanks before a line's end */
	char *clean = p->help;
	for (char *at = p->help; *at; at++) {
		if (*at == '\n')
			while (clean > p->help && clean[-1] == ' ')
				clean--;
		*clean++ = *at;
	}
	*clean = 0;
}

static void add_option(page *p, const char *tag, char *text)
{
	if (!*tag)
		return;
	first_sentence(text);
	char *to = p->help + strlen(p->help);
	size_t column = (size_t)sprintf(to, "  %-*s  ", TAG, tag);
	if (strlen(tag) > TAG) {
		sprintf(to, "  %s\n%*s", tag, TAG + 4, "");
		column = TAG + 4;
	}
	wrap(p, text, column, TAG + 4);
}

static void read_page(const char *path, page *p)
{
	enum { NONE, SYNOPSIS, DESCRIPTION, OPTIONS } section = NONE;
	char line[TEXT], text[TEXT], tag[TEXT] = "", body[TEXT] = "";
	int number = 0, want_tag = 0, paragraph = 0;
	FILE *in = fopen(path, "r");
	if (!in)
		fail(path, 0, "cannot read it");
	while (fgets(line, sizeof line, in)) {
		number++;
		line[strcspn(line, "\n")] = 0;
		if (!strncmp(line, ".\\\"", 3) || !*line)
			continue;
		if (!strncmp(line, ".TH ", 4)) {
			size_t n = 0;
			for (const char *at = line + 4; *at && *at != ' ' && n + 1 < sizeof p->name; at++)
				p->name[n++] = (char)tolower((unsigned char)*at);
			continue;
		}
		if (!strncmp(line, ".SH ", 4)) {
			words(line + 4, 0, text);
			if (section == OPTIONS)
				add_option(p, tag, body);
			section = !strcmp(text, "SYNOPSIS") ? SYNOPSIS : !strcmp(text, "DESCRIPTION") ? DESCRIPTION
				: !strcmp(text, "OPTIONS") ? OPTIONS : NONE;
			if (section == OPTIONS)
				wrap(p, p->description, 0, 0);
			continue;
		}
		if (!strcmp(line, ".PP") || !strcmp(line, ".br") || !strcmp(line, ".IP") || !strncmp(line, ".IP ", 4)) {
			paragraph += section == DESCRIPTION;
			continue;
		}
		if (!strcmp(line, ".TP")) {
			paragraph += section == DESCRIPTION;
			if (section == OPTIONS)
				add_option(p, tag, body);
			want_tag = 1;
			tag[0] = body[0] = 0;
			continue;
		}
		if (line[0] == '.' && isupper((unsigned char)line[1])) {
			const size_t length = strcspn(line, " ");
			if (length > 3 || !line[length] || strspn(line + 1, "BRI") != length - 1)
				fail(path, number, "a request that man2help does not know");
			words(line + length, length == 3, text);
		} else {
			strcpy(text, line);
			unescape(text);
		}
		if (section == SYNOPSIS)
			append(p->synopsis, sizeof p->synopsis, text);
		else if (section == DESCRIPTION && !paragraph)
			append(p->description, sizeof p->description, text);
		else if (section == OPTIONS && want_tag)
			append(tag, sizeof tag, text);
		else if (section == OPTIONS)
			append(body, sizeof body, text);
		want_tag = 0;
	}
	fclose(in);
	if (!*p->synopsis || !*p->help)
		fail(path, number, "needs SYNOPSIS, DESCRIPTION and OPTIONS");
}

static void write_string(FILE *out, const char *name, const char *text)
{
	fprintf(out, "const char %s[] =\n\t\"", name);
	for (const char *at = text; *at; at++)
		if (*at == '\n')
			fputs(at[1] ? "\\n\"\n\t\"" : "\\n", out);
		else
			fprintf(out, *at == '"' || *at == '\\' ? "\\%c" : "%c", *at);
	fputs("\";\n", out);
}

int main(int argc, char **argv)
{
	static page p;
	if (argc != 3)
		fail("man2help", 0, "needs a manual page and the file to write");
	read_page(argv[1], &p);
	FILE *out = fopen(argv[2], "w");
	if (!out)
		fail(argv[2], 0, "cannot write it");
	fprintf(out, "/* made by man2help from the manual page */\n#include \"common.h\"\n\n");
	/* the name itself is what the program was called by */
	write_string(out, "cmd_usage", p.synopsis + strcspn(p.synopsis, " ") + 1);
	write_string(out, "cmd_help", p.help);
	return fclose(out) ? 1 : 0;
}
