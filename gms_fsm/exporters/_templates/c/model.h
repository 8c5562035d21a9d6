/* What fmu_core.h must know about $title: places in the block, and variables. */
#ifndef MODEL_H
#define MODEL_H

#include <stdbool.h>
#include <stdint.h>

#define MODEL(name) ${name}_##name
#define TOKEN "$token"
#define FMI_VERSION $version
$constants

void ${name}_start(char *block);
void ${name}_derive(char *block);
int64_t ${name}_step(char *block);
void ${name}_restart(char *block);
int64_t ${name}_settle(char *block);
void ${name}_slope(char *block);
void ${name}_indicate(char *block);
int64_t ${name}_changed(char *block);
void ${name}_observe(char *block);

enum place { IN_BLOCK, INPUT, SEEN, SLOPES, INDICATOR, STATE, COUNT, TIME };
typedef struct {
    enum place place;
    int settable; /* before the start; of a state the number of states */
    int index;
} variable;

#ifdef FMU_CORE_H
/* By value reference. */
static const variable variables[VARIABLES] = {
$variables
};
static const int state_places[] = {$places};
static const double state_nominals[] = {$nominals};

static const char *reason(int64_t code)
{
    switch (code) {
$reasons
    default: return "the loop stopped";
    }
}
#endif

#endif
