/* json FILE: every shorter text of a program is refused, and texts with one changed byte are refused or read within their bounds, which
 * AddressSanitizer watches. */
#include "json.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Reads all that a program has. */
static size_t read_all(const char *text) {
    size_t sum = json_number(json_field(text, "format")) + json_number(json_item(json_field(text, "size"), 1));
    const char *lists[] = {"buffers", "shaders", "passes"};
    for (size_t l = 0; l < 3; l++) {
        const char *list = json_field(text, lists[l]);
        size_t count = json_count(list);
        for (size_t i = 0; i < count; i++) {
            const char *entry = json_item(list, i), *kind = NULL;
            char *string = json_string(entry);
            sum += string ? strlen(string) : 0;
            free(string);
            sum += json_number(json_field(entry, "bytes")) + (size_t)json_true(json_field(entry, "sees_frame"));
            sum += json_number(json_only(json_item(json_field(entry, "bindings"), 0), &kind)) + (size_t)json_is(kind, "read");
        }
    }
    return sum;
}

/* A copy that ends where its memory ends. */
static char *copy(const char *text, size_t bytes) {
    char *made = malloc(bytes + 1);
    if (!made) exit(1);
    memcpy(made, text, bytes);
    made[bytes] = 0;
    return made;
}

int main(int count, char **arguments) {
    FILE *file = count == 2 ? fopen(arguments[1], "rb") : NULL;
    static char text[1 << 22];
    size_t bytes = file ? fread(text, 1, sizeof text - 1, file) : 0;
    if (!bytes || !json_valid(text, text + bytes) || json_number(json_field(text, "format")) != 1) {
        fprintf(stderr, "usage: json program.json\n");
        return 2;
    }
    size_t whole = read_all(text), different = 0;
    unsigned random = 1;
    for (size_t i = 0; i < 500; i++) {
        random = random * 1664525u + 1013904223u;
        size_t at = (i < 100 ? i : random) % bytes;
        char *shorter = copy(text, at);
        if (json_valid(shorter, shorter + at)) {
            fprintf(stderr, "accepted the first %u bytes\n", (unsigned)at);
            return 1;
        }
        free(shorter);
        char *changed = copy(text, bytes);
        changed[at] = "\"\\{}[],:1x\n"[random >> 24 & 7];
        if (json_valid(changed, changed + bytes)) different += read_all(changed) != whole;
        free(changed);
    }
    printf("%u of the changed texts are other programs\n", (unsigned)different);
    return 0;
}
