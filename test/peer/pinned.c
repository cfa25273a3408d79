/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * For test_unchanged.py, preloaded: large blocks of memory come from a fixed place, one after the other, and are never given back.
 * Radiance seeds the random numbers of a glossy surface with the address of its material, so that two programs of different size
 * draw different ones, and can be compared bit by bit only like this.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <stddef.h>
#include <string.h>
#include <sys/mman.h>

enum { LARGE = 1 << 16, HEAD = 64 };
#define BASE ((char *)0x20000000000)
#define ROOM ((size_t)1 << 32)

static char *next;

static int pinned(const void *block)
{
	return (const char *)block >= BASE && (const char *)block < BASE + ROOM;
}

static void *real(const char *name)
{
	return dlsym(RTLD_NEXT, name);
}

static void *take(size_t size)
{
	if (!next)
		next = mmap(BASE, ROOM, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE | MAP_FIXED_NOREPLACE, -1, 0);
	if (!pinned(next) || size > (size_t)(BASE + ROOM - next) - 2 * HEAD) {
		errno = ENOMEM;
		return NULL;
	}
	char *block = next + HEAD;
	memcpy(next, &size, sizeof size);
	next = block + (size + HEAD - 1) / HEAD * HEAD;
	return block;
}

void *malloc(size_t size)
{
	static void *(*libc)(size_t);
	if (!libc)
		libc = (void *(*)(size_t))real("malloc");
	return size < LARGE ? libc(size) : take(size);
}

/* glibc's own, since dlsym() itself calls calloc */
extern void *__libc_calloc(size_t, size_t);
void *calloc(size_t count, size_t size)
{
	return count * size < LARGE ? __libc_calloc(count, size) : take(count * size); /* fresh pages are zero */
}

void free(void *block)
{
	static void (*libc)(void *);
	if (pinned(block))
		return;
	if (!libc)
		libc = (void (*)(void *))real("free");
	libc(block);
}

void *realloc(void *block, size_t size)
{
	static void *(*libc)(void *, size_t);
	size_t had = 0;
	if (!libc)
		libc = (void *(*)(void *, size_t))real("realloc");
	if (!pinned(block) && (block || size < LARGE))
		return libc(block, size);
	void *new = malloc(size);
	if (new && block) {
		memcpy(&had, (char *)block - HEAD, sizeof had);
		memcpy(new, block, had < size ? had : size);
	}
	return new;
}
