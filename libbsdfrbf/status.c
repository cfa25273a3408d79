/* SPDX-License-Identifier: BSD-3-Clause */
#include "status.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

struct bsdfrbf_context {
	char message[1024];
	void (*warn)(void *, const char *);
	void *warn_user;
	int (*progress)(void *, const char *, double);
	void *progress_user;
};

const char *bsdfrbf_version(void)
{
#define RBF_TEXT_(x) #x
#define RBF_TEXT(x) RBF_TEXT_(x)
	return RBF_TEXT(BSDFRBF_VERSION_MAJOR) "." RBF_TEXT(BSDFRBF_VERSION_MINOR) "." RBF_TEXT(BSDFRBF_VERSION_PATCH);
}

const char *bsdfrbf_status_text(bsdfrbf_status status)
{
	switch (status) {
	case BSDFRBF_OK: return "ok";
	case BSDFRBF_ERR_ARGUMENT: return "bad argument";
	case BSDFRBF_ERR_MEMORY: return "out of memory";
	case BSDFRBF_ERR_IO: return "cannot read or write";
	case BSDFRBF_ERR_SYNTAX: return "malformed text";
	case BSDFRBF_ERR_DATA: return "unusable measurements";
	case BSDFRBF_ERR_FORMAT: return "damaged or foreign file";
	case BSDFRBF_ERR_VERSION: return "file from a later version";
	case BSDFRBF_ERR_UNSUPPORTED: return "not supported";
	case BSDFRBF_ERR_CANCELLED: return "cancelled";
	case BSDFRBF_ERR_INTERNAL: return "internal error";
	}
	return "unknown status";
}

bsdfrbf_context *bsdfrbf_context_new(void)
{
	return calloc(1, sizeof(bsdfrbf_context));
}

void bsdfrbf_context_free(bsdfrbf_context *context)
{
	free(context);
}

const char *bsdfrbf_message(const bsdfrbf_context *context)
{
	return context ? context->message : "";
}

void bsdfrbf_set_warning(bsdfrbf_context *context, void (*warn)(void *, const char *), void *user)
{
	context->warn = warn;
	context->warn_user = user;
}

void bsdfrbf_set_progress(bsdfrbf_context *context, int (*progress)(void *, const char *, double), void *user)
{
	context->progress = progress;
	context->progress_user = user;
}

bsdfrbf_status rbf_fail(bsdfrbf_context *context, bsdfrbf_status status, const char *format, ...)
{
	if (context) {
		va_list arguments;
		va_start(arguments, format);
		vsnprintf(context->message, sizeof context->message, format, arguments);
		va_end(arguments);
	}
	return status;
}

bsdfrbf_status rbf_out_of_memory(bsdfrbf_context *context)
{
	return rbf_fail(context, BSDFRBF_ERR_MEMORY, "out of memory");
}

void rbf_warn(bsdfrbf_context *context, const char *format, ...)
{
	if (!context || !context->warn)
		return;
	char text[1024];
	va_list arguments;
	va_start(arguments, format);
	vsnprintf(text, sizeof text, format, arguments);
	va_end(arguments);
	context->warn(context->warn_user, text);
}

int rbf_progress(bsdfrbf_context *context, const char *stage, double done)
{
	return context && context->progress ? context->progress(context->progress_user, stage, done) : 0;
}
