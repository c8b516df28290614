#include "json.h"

#include <ctype.h>
#include <stdlib.h>
#include <string.h>

/* Arrays in arrays of a program are far fewer. */
enum { DEEPEST = 32 };

static const char *space(const char *at, const char *end) {
    while (at && at < end && isspace((unsigned char)*at)) at++;
    return at;
}

static const char *string_end(const char *at, const char *end) {
    for (at++; at < end && *at != '"'; at++) {
        if (*at == '\\') at++;
    }
    return at < end ? at + 1 : NULL;
}

/* Behind a value, or NULL where there is none. */
static const char *value_end(const char *at, const char *end, int depth) {
    at = space(at, end);
    if (!at || at >= end || depth > DEEPEST) return NULL;
    if (*at == '"') return string_end(at, end);
    if (*at != '{' && *at != '[') {
        const char *begin = at;
        while (at < end && (isalnum((unsigned char)*at) || strchr("+-.", *at))) at++;
        return at > begin ? at : NULL;
    }
    int object = *at == '{';
    char closes = object ? '}' : ']';
    at = space(at + 1, end);
    if (at < end && *at == closes) return at + 1;
    while (at && at < end) {
        if (object) {
            at = *at == '"' ? space(string_end(at, end), end) : NULL;
            if (!at || at >= end || *at++ != ':') return NULL;
        }
        at = space(value_end(at, end, depth + 1), end);
        if (!at || at >= end) return NULL;
        if (*at == closes) return at + 1;
        if (*at != ',') return NULL;
        at = space(at + 1, end);
    }
    return NULL;
}

int json_valid(const char *text, const char *end) { return space(value_end(text, end, 0), end) == end; }

/* Whatever follows was found to be valid: a text ends with its value. */
static const char *skip(const char *at) { return value_end(at, at + strlen(at), 0); }

static const char *next(const char *at) {
    at = skip(at);
    while (isspace((unsigned char)*at)) at++;
    if (*at != ',') return NULL;
    do at++;
    while (isspace((unsigned char)*at));
    return at;
}

static const char *first(const char *value, char opens, char closes) {
    if (!value || *value != opens) return NULL;
    do value++;
    while (isspace((unsigned char)*value));
    return *value == closes ? NULL : value;
}

static const char *behind_colon(const char *name) {
    const char *at = skip(name);
    while (isspace((unsigned char)*at)) at++;
    do at++;
    while (isspace((unsigned char)*at));
    return at;
}

const char *json_field(const char *object, const char *name) {
    const char *at = first(object, '{', '}');
    while (at) {
        const char *value = behind_colon(at);
        if (json_is(at, name)) return value;
        at = next(value);
    }
    return NULL;
}

const char *json_only(const char *object, const char **name) {
    const char *at = first(object, '{', '}');
    if (!at) return NULL;
    *name = at;
    return behind_colon(at);
}

const char *json_item(const char *array, size_t index) {
    const char *at = first(array, '[', ']');
    for (; at && index > 0; index--) at = next(at);
    return at;
}

size_t json_count(const char *array) {
    size_t count = 0;
    for (const char *at = first(array, '[', ']'); at; at = next(at)) count++;
    return count;
}

uint64_t json_number(const char *value) { return value && isdigit((unsigned char)*value) ? strtoull(value, NULL, 10) : 0; }

int json_true(const char *value) { return value && *value == 't'; }

int json_is(const char *value, const char *text) {
    size_t length = strlen(text);
    return value && *value == '"' && strncmp(value + 1, text, length) == 0 && value[length + 1] == '"';
}

char *json_string(const char *value) {
    if (!value || *value != '"') return NULL;
    char *copy = malloc(strlen(value)), *to = copy;
    for (const char *at = value + 1; copy && *at && *at != '"'; at++) {
        char c = *at;
        if (c == '\\') {
            /* Shaders are ASCII: of all escapes, these occur. */
            c = *++at;
            c = c == 'n' ? '\n' : c == 't' ? '\t' : c;
        }
        *to++ = c;
    }
    if (copy) *to = 0;
    return copy;
}
