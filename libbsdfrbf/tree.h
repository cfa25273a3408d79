/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * A tree over (incident, exitant) cells: 1 or 2 incident dimensions, 2 exitant ones, halved together. It is made from its finest
 * cells upwards, one incident cell after another, so that only what differs is ever held in memory. Dimension d of a node's
 * children is bit d of the child's number; the incident dimensions come first.
 */
#ifndef RBF_TREE_H
#define RBF_TREE_H
#include "xml_write.h"

#include <stdint.h>

#define RBF_TREE_LEAF 0xffffffffu   /* child: none */
#define RBF_TREE_GROUP 0x0fffffffu  /* child: number of its group of children; the four bits above mirror the dimensions */

#define RBF_TREE_KEEP 1e9f          /* error of an item that is not to be joined with others */

typedef struct rbf_tree_item {
	float value[3];  /* mean */
	float error;     /* mean over the cells below of |value - mean|, as a share of the mean value of their incidence */
	uint32_t child;
} rbf_tree_item;

typedef struct rbf_tree {
	int inputs, channels;
	rbf_tree_item *item; /* groups of 2^(inputs + 2) */
	uint32_t groups, room;
} rbf_tree;

/* Joins 2^inputs neighbouring incident cells: below[] holds the items of each, 4^(level + 1) of them, y by y; `above` gets 4^level.
 * Differences up to `keep` are dropped. scale: 1 / mean value, per channel. 0: out of memory. */
int rbf_tree_join(rbf_tree *tree, int level, rbf_tree_item *const below[], const double scale[3], float keep, rbf_tree_item *above);

/* Takes the groups of another tree over, which is then empty, and mends `count` items that refer to them. 0: out of memory. */
int rbf_tree_take(rbf_tree *tree, rbf_tree *from, size_t count, rbf_tree_item *item);

/* The smallest error limit with at most `most` leaves under the root. */
float rbf_tree_limit(const rbf_tree *tree, const rbf_tree_item *root, double most);

/* Leaves under the root, and the mean error that they stand for, at an error limit. */
void rbf_tree_count(const rbf_tree *tree, const rbf_tree_item *root, float limit, double *leaves, double *error);

/* Writes the tree as Radiance reads it. quantity: 0 luminance, 1 u', 2 v' (CIE 1976). */
void rbf_tree_write(const rbf_tree *tree, const rbf_tree_item *root, float limit, int quantity, rbf_xml *xml);
#endif
