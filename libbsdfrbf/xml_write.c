/* SPDX-License-Identifier: BSD-3-Clause */
#include "carrier.h"
#include "model.h"
#include "xml_write.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

bsdfrbf_status rbf_xml_begin(bsdfrbf_context *context, const bsdfrbf_resample_options *options, rbf_xml *xml)
{
	memset(xml, 0, offsetof(rbf_xml, buffer));
	xml->context = context;
	xml->write = options->write;
	xml->user = options->user;
	if (options->path) {
		RBF_TRY(rbf_replace_begin(context, options->path, 0, &xml->replace));
		xml->to_path = 1;
	}
	return BSDFRBF_OK;
}

static void flush(rbf_xml *xml)
{
	if (xml->status == BSDFRBF_OK && xml->used) {
		if (!xml->to_path) {
			if (xml->write(xml->user, xml->buffer, xml->used))
				xml->status = rbf_fail(xml->context, BSDFRBF_ERR_IO, "the XML could not be written");
		} else if ((xml->status = rbf_replace_write(&xml->replace, xml->buffer, xml->used)) != BSDFRBF_OK)
			xml->to_path = 0; /* released already */
	}
	xml->used = 0;
}

static void append(rbf_xml *xml, const char *text, size_t bytes)
{
	while (bytes > 0) {
		const size_t room = sizeof xml->buffer - xml->used, part = bytes < room ? bytes : room;
		memcpy(xml->buffer + xml->used, text, part);
		xml->used += part;
		text += part;
		bytes -= part;
		if (xml->used == sizeof xml->buffer)
			flush(xml);
	}
}

void rbf_xml_put(rbf_xml *xml, const char *format, ...)
{
	char text[4096];
	va_list arguments;
	va_start(arguments, format);
	const int bytes = vsnprintf(text, sizeof text, format, arguments);
	va_end(arguments);
	append(xml, text, bytes < 0 ? 0 : (size_t)bytes < sizeof text ? (size_t)bytes : sizeof text - 1);
}

void rbf_xml_number(rbf_xml *xml, double value)
{
	char text[48];
	int to = 0;
	snprintf(text, sizeof text, "%.6g", value);
	/* the host's locale may have put something else where the point belongs, of one byte or more */
	for (int from = 0; text[from]; from++)
		if (strchr("+-0123456789einfa", text[from]))
			text[to++] = text[from];
		else if (!to || text[to - 1] != '.')
			text[to++] = '.';
	append(xml, text, (size_t)to);
}

/* Bytes of the character at `text` if it is valid UTF-8 beyond ASCII (RFC 3629) and XML allows it, else 0. */
static size_t wide_character(const char *text)
{
	const unsigned char *c = (const unsigned char *)text;
	const size_t bytes = *c >= 0xc2 && *c < 0xe0 ? 2 : *c >= 0xe0 && *c < 0xf0 ? 3 : *c >= 0xf0 && *c < 0xf5 ? 4 : 0;
	for (size_t i = 1; i < bytes; i++)
		if ((c[i] & 0xc0) != 0x80)
			return 0;
	/* overlong forms, surrogates, beyond Unicode, U+FFFE and U+FFFF */
	if ((*c == 0xe0 && c[1] < 0xa0) || (*c == 0xed && c[1] >= 0xa0) || (*c == 0xf0 && c[1] < 0x90) || (*c == 0xf4 && c[1] >= 0x90)
			|| (*c == 0xef && c[1] == 0xbf && c[2] >= 0xbe))
		return 0;
	return bytes;
}

/* Text as content of an element, or of a comment: there two hyphens must not meet. What is not UTF-8, such as the Latin-1
 * of an old instrument, becomes '?': a parser would refuse the file for it. */
static void escaped(rbf_xml *xml, const char *text, int comment)
{
	for (; *text; text++) {
		const unsigned char c = (unsigned char)*text;
		if (c >= 0x80) {
			const size_t bytes = wide_character(text);
			append(xml, bytes ? text : "?", bytes ? bytes : 1);
			text += bytes ? bytes - 1 : 0;
		} else if (comment) {
			if (c == '-' && text[1] == '-')
				append(xml, "- ", 2);
			else
				append(xml, c < ' ' && c != '\n' && c != '\t' ? " " : text, 1);
		} else if (c == '<')
			append(xml, "&lt;", 4);
		else if (c == '>')
			append(xml, "&gt;", 4);
		else if (c == '&')
			append(xml, "&amp;", 5);
		else
			append(xml, c < ' ' ? " " : text, 1);
	}
}

static void element(rbf_xml *xml, const char *name, const char *text)
{
	rbf_xml_put(xml, "\t\t<%s>", name);
	escaped(xml, text, 0);
	rbf_xml_put(xml, "</%s>\n", name);
}

static void length(rbf_xml *xml, const char *name, double value)
{
	if (value > 0) {
		rbf_xml_put(xml, "\t\t<%s unit=\"Meter\">", name);
		rbf_xml_number(xml, value);
		rbf_xml_put(xml, "</%s>\n", name);
	}
}

void rbf_xml_head(rbf_xml *xml, const bsdfrbf_model *model, const bsdfrbf_resample_options *options, const char *facts)
{
	const char *name = options->name ? options->name : bsdfrbf_get_text(model, "name");
	rbf_xml_put(xml, "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<!-- bsdfrbf %s\n", bsdfrbf_version());
	if (options->comment) {
		escaped(xml, options->comment, 1);
		append(xml, "\n", 1);
	}
	escaped(xml, facts, 1);
	rbf_xml_put(xml, " -->\n"
		"<WindowElement xmlns=\"http://windows.lbl.gov\" xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\""
		" xsi:schemaLocation=\"http://windows.lbl.gov/BSDF-v1.4.xsd\">\n"
		"<WindowElementType>System</WindowElementType>\n<FileType>BSDF</FileType>\n<Optical>\n<Layer>\n\t<Material>\n");
	element(xml, "Name", *name ? name : "Name");
	element(xml, "Manufacturer", options->manufacturer ? options->manufacturer : "Manufacturer");
	length(xml, "Thickness", options->thickness);
	length(xml, "Width", options->width);
	length(xml, "Height", options->height);
	rbf_xml_put(xml, "\t\t<DeviceType>Other</DeviceType>\n\t</Material>\n");
}

static void base64(rbf_xml *xml, const unsigned char *data, size_t bytes)
{
	static const char digit[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
	enum { LINE = 57 };
	for (size_t at = 0; at < bytes; at += LINE) {
		const size_t count = bytes - at < LINE ? bytes - at : LINE;
		char line[LINE / 3 * 4 + 1], *to = line;
		for (size_t i = 0; i < count; i += 3) {
			const unsigned char *from = data + at + i;
			const uint32_t bits = (uint32_t)from[0] << 16 | (i + 1 < count ? (uint32_t)from[1] << 8 : 0) | (i + 2 < count ? from[2] : 0);
			*to++ = digit[bits >> 18];
			*to++ = digit[bits >> 12 & 63];
			*to++ = i + 1 < count ? digit[bits >> 6 & 63] : '=';
			*to++ = i + 2 < count ? digit[bits & 63] : '=';
		}
		*to++ = '\n';
		append(xml, line, (size_t)(to - line));
	}
}

void rbf_xml_tail(rbf_xml *xml, const bsdfrbf_model *model, const bsdfrbf_resample_options *options)
{
	rbf_xml_put(xml, "</Layer>\n</Optical>\n");
	if (options->embed) {
		append(xml, RBF_CARRIER_DATA, sizeof RBF_CARRIER_DATA - 1);
		base64(xml, model->mapping, model->mapping_bytes);
		rbf_xml_put(xml, "-->\n");
	}
	if (options->embed || options->link) {
		rbf_xml_put(xml, RBF_CARRIER_MARK);
		if (!options->embed) {
			rbf_xml_put(xml, "file=");
			for (const char *at = options->link; *at; at++) {
				const int plain = (*at >= 'a' && *at <= 'z') || (*at >= 'A' && *at <= 'Z') || (*at >= '0' && *at <= '9')
					|| strchr("._/", *at);
				rbf_xml_put(xml, plain ? "%c" : "%%%02X", (unsigned char)*at);
			}
			rbf_xml_put(xml, " ");
		}
		rbf_xml_put(xml, "bytes=%zu checksum=%016llx -->\n", model->mapping_bytes, (unsigned long long)bsdfrbf_checksum(model));
	}
	rbf_xml_put(xml, "</WindowElement>\n");
}

void rbf_xml_data_begin(rbf_xml *xml, bsdfrbf_component component, const char *what, const char *basis)
{
	/* the schema's front is the exterior, which is the back here */
	static const char *const direction[4] = {
		[BSDFRBF_RF] = "Reflection Back", [BSDFRBF_RB] = "Reflection Front",
		[BSDFRBF_TF] = "Transmission Back", [BSDFRBF_TB] = "Transmission Front"};
	const int solar = !strcmp(what, "Solar");
	const char *detector = solar ? "None" : !strcmp(what, "CIE-X") ? "ASTM E308 1931 X.dsp"
		: !strcmp(what, "CIE-Z") ? "ASTM E308 1931 Z.dsp" : !strcmp(what, "Visible") ? "ASTM E308 1931 Y.dsp" : "None";
	rbf_xml_put(xml, "\t<WavelengthData>\n\t\t<LayerNumber>System</LayerNumber>\n"
		"\t\t<Wavelength unit=\"Integral\">%s</Wavelength>\n\t\t<SourceSpectrum>%s</SourceSpectrum>\n"
		"\t\t<DetectorSpectrum>%s</DetectorSpectrum>\n\t\t<WavelengthDataBlock>\n"
		"\t\t\t<WavelengthDataDirection>%s</WavelengthDataDirection>\n", what,
		solar ? "ASTM E891 Table 1 Direct Sun" : "CIE Illuminant D65 1nm.ssp", detector, direction[component]);
	append(xml, basis, strlen(basis));
	rbf_xml_put(xml, "\t\t\t<ScatteringDataType>BTDF</ScatteringDataType>\n\t\t\t<ScatteringData>\n");
}

void rbf_xml_data_end(rbf_xml *xml)
{
	rbf_xml_put(xml, "\n\t\t\t</ScatteringData>\n\t\t</WavelengthDataBlock>\n\t</WavelengthData>\n");
}

bsdfrbf_status rbf_xml_finish(rbf_xml *xml)
{
	flush(xml);
	if (xml->to_path) {
		if (xml->status == BSDFRBF_OK)
			return rbf_replace_commit(&xml->replace);
		rbf_replace_abort(&xml->replace);
	}
	return xml->status;
}
