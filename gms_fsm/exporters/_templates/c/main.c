/* Runs ${name}.c on a record. It reads rows $columns from the standard input,
 * whose first line names the columns, and writes the outputs. With a file name as argument it also
 * writes each switch to that file: time, element (from 1), edge. Written by gms-fsm. */
#include "${name}.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LONGEST = 4096 };

static void write_row(const ${name}_state *s)
{
    printf("%.17g", s->t);
$rows
    printf("\n");
}

static void write_switches(const ${name}_state *s, FILE *file)
{
    double t;
    int64_t element, edge;
    for (int64_t k = 0; k < s->logged; k++) {
        ${name}_switch(s, k, &t, &element, &edge);
        fprintf(file, "%.17g,%d,%s\n", t, (int)element + 1, ${name}_edge(edge));
    }
}

/* Read the next number of a line; a comma or the end of the line must follow. */
static double number(char **place, int *read)
{
    char *end;
    const double value = strtod(*place, &end);
    *read += end > *place && strchr(",\r\n", *end) != NULL;
    *place = *end == ',' ? end + 1 : end;
    return value;
}

int main(int argc, char **argv)
{
    static char line[LONGEST];
    FILE *switches = argc > 1 ? fopen(argv[1], "w") : NULL;
    ${name}_state s;
    int code = ${name}_OK;
    long row = 1;
$before    if (argc > 1 && !switches) {
        fprintf(stderr, "cannot write %s\n", argv[1]);
        return 1;
    }
    if (!fgets(line, LONGEST, stdin) || strcspn(line, "\r\n") != strlen("$columns")
        || strncmp(line, "$columns", strlen("$columns")) != 0) {
        fprintf(stderr, "row 1: the columns must be $columns\n");
        return 1;
    }
    ${name}_init(&s);
    printf("t,$heads\n");
    while (code == ${name}_OK && fgets(line, LONGEST, stdin)) {
        char *place = line;
        int read = 0;
        const double t = number(&place, &read);
        row++;
$read        if (read != $count || !strchr("\r\n", *place)) {
            fprintf(stderr, "row %ld: it must have $count numbers\n", row);
            return 1;
        }
        code = ${name}_advance_to(&s, ${pairs}t, ${name}_MAX_STEPS);
        if (code == ${name}_OK) {
            write_row(&s);
            if (switches)
                write_switches(&s, switches);
        }
    }
    if (switches)
        fclose(switches);
    if (code == ${name}_OK)
        return 0;
    fprintf(stderr, "row %ld: %s\n", row, ${name}_message(code));
    return 1;
}
