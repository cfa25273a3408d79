/* SPDX-License-Identifier: BSD-3-Clause */
#include "tree.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Room for one more group; its number, or RBF_TREE_LEAF. */
static uint32_t new_group(rbf_tree *t)
{
	const size_t group = (size_t)1 << (t->inputs + 2);
	if (t->groups == t->room) {
		const uint32_t room = t->room ? t->room + t->room / 2 : 256;
		rbf_tree_item *item = room < RBF_TREE_GROUP ? realloc(t->item, room * group * sizeof *item) : NULL;
		if (!item)
			return RBF_TREE_LEAF;
		t->item = item;
		t->room = room;
	}
	return t->groups++;
}

int rbf_tree_join(rbf_tree *t, int level, rbf_tree_item *const below[], const double scale[3], float keep, rbf_tree_item *above)
{
	const int inputs = t->inputs, count = 4 << inputs;
	for (uint32_t y = 0; y < 1u << level; y++)
		for (uint32_t x = 0; x < 1u << level; x++) {
			rbf_tree_item group[16], *const mean = above + ((size_t)y << level | x);
			double sum[3] = {0}, error = 0;
			int leaves = 1;
			for (int n = 0; n < count; n++) {
				const uint32_t o = (uint32_t)n >> inputs;
				group[n] = below[n & ((1 << inputs) - 1)][(size_t)(2*y + (o >> 1)) << (level + 1) | (2*x + (o & 1))];
				leaves &= group[n].child == RBF_TREE_LEAF;
				for (int c = 0; c < t->channels; c++)
					sum[c] += (double)group[n].value[c];
			}
			memset(mean, 0, sizeof *mean);
			for (int c = 0; c < t->channels; c++)
				mean->value[c] = (float)(sum[c] / count);
			for (int n = 0; n < count; n++) {
				double most = 0;
				for (int c = 0; c < t->channels; c++)
					most = fmax(most, scale[c] * fabs((double)(group[n].value[c] - mean->value[c])));
				error += (double)group[n].error + most;
			}
			mean->error = (float)(error / count);
			mean->child = RBF_TREE_LEAF;
			if (leaves && mean->error <= keep)
				continue;
			if ((mean->child = new_group(t)) == RBF_TREE_LEAF)
				return 0;
			memcpy(t->item + (size_t)mean->child * (size_t)count, group, (size_t)count * sizeof *group);
		}
	return 1;
}

static void move_children(rbf_tree_item *item, size_t count, uint32_t groups)
{
	for (size_t n = 0; n < count; n++)
		if (item[n].child != RBF_TREE_LEAF)
			item[n].child += groups;
}

int rbf_tree_take(rbf_tree *t, rbf_tree *from, size_t count, rbf_tree_item *item)
{
	const size_t group = (size_t)1 << (t->inputs + 2);
	if (t->room - t->groups < from->groups) {
		const uint64_t room = (uint64_t)t->groups + from->groups;
		rbf_tree_item *grown = room < RBF_TREE_GROUP ? realloc(t->item, room * group * sizeof *grown) : NULL;
		if (!grown)
			return 0;
		t->item = grown;
		t->room = (uint32_t)room;
	}
	if (from->groups)
		memcpy(t->item + t->groups * group, from->item, from->groups * group * sizeof *item);
	move_children(t->item + t->groups * group, from->groups * group, t->groups);
	move_children(item, count, t->groups);
	t->groups += from->groups;
	free(from->item);
	from->item = NULL;
	from->groups = from->room = 0;
	return 1;
}

static int is_leaf(const rbf_tree_item *item, float limit)
{
	return item->child == RBF_TREE_LEAF || item->error <= limit;
}

/* Child n of an item that is seen with its dimensions mirrored by `mask`. */
static const rbf_tree_item *child_of(const rbf_tree *t, const rbf_tree_item *item, uint32_t mask, uint32_t n)
{
	return t->item + ((size_t)(item->child & RBF_TREE_GROUP) << (t->inputs + 2) | (n ^ mask));
}

static uint32_t mask_of(const rbf_tree_item *item, uint32_t mask)
{
	return item->child == RBF_TREE_LEAF ? mask : mask ^ item->child >> 28;
}

static void count(const rbf_tree *t, const rbf_tree_item *item, float limit, double volume, double *leaves, double *error)
{
	if (is_leaf(item, limit)) {
		*leaves += 1;
		*error += item->error < RBF_TREE_KEEP ? volume * (double)item->error : 0;
		return;
	}
	const uint32_t children = 4u << t->inputs;
	for (uint32_t n = 0; n < children; n++)
		count(t, child_of(t, item, 0, n), limit, volume / children, leaves, error);
}

void rbf_tree_count(const rbf_tree *t, const rbf_tree_item *root, float limit, double *leaves, double *error)
{
	*leaves = *error = 0;
	count(t, root, limit, 1, leaves, error);
}

float rbf_tree_limit(const rbf_tree *t, const rbf_tree_item *root, double most)
{
	double low = log(1e-7), high = log(10.), leaves, error;
	rbf_tree_count(t, root, 0, &leaves, &error);
	if (leaves <= most)
		return 0;
	for (int n = 0; n < 24; n++) {
		const double middle = (low + high) / 2;
		rbf_tree_count(t, root, (float)exp(middle), &leaves, &error);
		if (leaves > most)
			low = middle;
		else
			high = middle;
	}
	return (float)exp(high);
}

static double quantity_of(const rbf_tree *t, const rbf_tree_item *item, int quantity)
{
	if (t->channels == 1)
		return (double)item->value[0];
	if (quantity == 0)
		return (double)item->value[1];
	const double d = (double)item->value[0] + 15 * (double)item->value[1] + 3 * (double)item->value[2];
	if (!(d > 0))
		return quantity == 1 ? 4. / 19 : 9. / 19; /* equal energy */
	return quantity == 1 ? 4 * (double)item->value[0] / d : 9 * (double)item->value[1] / d;
}

/* Whether the chromaticity below an item stays within what eyes tell apart, so that one value serves. */
static int even(const rbf_tree *t, const rbf_tree_item *item, float limit, int quantity, double mean)
{
	if (is_leaf(item, limit))
		return fabs(quantity_of(t, item, quantity) - mean) < 5e-4;
	for (uint32_t n = 0; n < 4u << t->inputs; n++)
		if (!even(t, child_of(t, item, 0, n), limit, quantity, mean))
			return 0;
	return 1;
}

static int writes_leaf(const rbf_tree *t, const rbf_tree_item *item, float limit, int quantity)
{
	return is_leaf(item, limit) || (quantity && even(t, item, limit, quantity, quantity_of(t, item, quantity)));
}

static void write_item(const rbf_tree *t, const rbf_tree_item *item, uint32_t mask, float limit, int quantity, int depth, rbf_xml *xml)
{
	rbf_xml_put(xml, "%*s{", depth < 8 ? depth : 8, "");
	if (writes_leaf(t, item, limit, quantity)) {
		rbf_xml_put(xml, " ");
		rbf_xml_number(xml, quantity_of(t, item, quantity));
		rbf_xml_put(xml, " }\n");
		return;
	}
	const int dimensions = t->inputs + 2;
	const uint32_t children = 1u << dimensions;
	int grid = 1;
	mask = mask_of(item, mask);
	for (uint32_t n = 0; n < children && grid; n++)
		grid = writes_leaf(t, child_of(t, item, 0, n), limit, quantity);
	rbf_xml_put(xml, grid ? "" : "\n");
	for (uint32_t p = 0; p < children; p++) {
		if (!grid) {
			const rbf_tree_item *child = child_of(t, item, mask, p);
			write_item(t, child, mask, limit, quantity, depth + 1, xml);
			continue;
		}
		uint32_t n = 0; /* in a grid of values the first dimension varies slowest */
		for (int d = 0; d < dimensions; d++)
			n |= (p >> (dimensions - 1 - d) & 1) << d;
		rbf_xml_put(xml, " ");
		rbf_xml_number(xml, quantity_of(t, child_of(t, item, mask, n), quantity));
	}
	if (grid)
		rbf_xml_put(xml, " }\n");
	else
		rbf_xml_put(xml, "%*s}\n", depth < 8 ? depth : 8, "");
}

void rbf_tree_write(const rbf_tree *t, const rbf_tree_item *root, float limit, int quantity, rbf_xml *xml)
{
	write_item(t, root, 0, limit, quantity, 0, xml);
}
