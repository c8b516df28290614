/* Reads JSON where it lies. A value is the place of its first character; NULL is a value that is not there, and is answered with 0,
 * NULL or nothing by all functions. */
#ifndef AONET_JSON_H
#define AONET_JSON_H

#include <stddef.h>
#include <stdint.h>

/* Whether the whole text is one value. */
int json_valid(const char *text, const char *end);

/* A field of an object. */
const char *json_field(const char *object, const char *name);

/* The only field of an object: its value, and the first character of its name. */
const char *json_only(const char *object, const char **name);

/* The item at a place of an array. */
const char *json_item(const char *array, size_t index);

size_t json_count(const char *array);

/* A whole number that is not negative. */
uint64_t json_number(const char *value);

int json_true(const char *value);

/* Whether a string is this one. */
int json_is(const char *value, const char *text);

/* A copy of a string without escapes, to be freed; NULL without memory. */
char *json_string(const char *value);

#endif
