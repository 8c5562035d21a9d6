/* The functions of FMI 2.0. The types are those that the standard prescribes. */
#include "fmu_core.h"

#if defined(FMI2_FUNCTION_PREFIX) /* several FMUs in one program */
#define JOINED(a, b) a##b
#define JOIN(a, b) JOINED(a, b)
#define FMI2(name) JOIN(FMI2_FUNCTION_PREFIX, name)
#else
#define FMI2(name) name
#endif
#if defined(_WIN32) || defined(__CYGWIN__)
#define EXPORT __declspec(dllexport)
#elif defined(__GNUC__)
#define EXPORT __attribute__((visibility("default")))
#else
#define EXPORT
#endif

typedef void *fmi2Component;
typedef void *fmi2ComponentEnvironment;
typedef void *fmi2FMUstate;
typedef unsigned int fmi2ValueReference;
typedef double fmi2Real;
typedef int fmi2Integer;
typedef int fmi2Boolean;
typedef char fmi2Char;
typedef const fmi2Char *fmi2String;
typedef char fmi2Byte;
typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef enum { fmi2ModelExchange, fmi2CoSimulation } fmi2Type;
typedef enum { fmi2DoStepStatus, fmi2PendingStatus, fmi2LastSuccessfulTime, fmi2Terminated } fmi2StatusKind;
typedef void (*fmi2CallbackLogger)(fmi2ComponentEnvironment, fmi2String instanceName, fmi2Status,
                                   fmi2String category, fmi2String message, ...);
typedef struct {
    fmi2CallbackLogger logger;
    void *(*allocateMemory)(size_t, size_t);
    void (*freeMemory)(void *);
    void (*stepFinished)(fmi2ComponentEnvironment, fmi2Status);
    fmi2ComponentEnvironment componentEnvironment;
} fmi2CallbackFunctions;
typedef struct {
    fmi2Boolean newDiscreteStatesNeeded;
    fmi2Boolean terminateSimulation;
    fmi2Boolean nominalsOfContinuousStatesChanged;
    fmi2Boolean valuesOfContinuousStatesChanged;
    fmi2Boolean nextEventTimeDefined;
    fmi2Real nextEventTime;
} fmi2EventInfo;

#define C fmi2Component c
#define REFERENCES const fmi2ValueReference vr[], size_t n
#define UNUSED(x) (void)(x)

static fmi2Status status(bool fine) { return fine ? fmi2OK : fmi2Error; }

static void tell(const instance *it, const char *message)
{
    if (it->logger != NULL)
        ((fmi2CallbackLogger)it->logger)(it->environment, it->name, fmi2Error, "logStatusError",
                                         "%s", message);
}

static fmi2Status unsupported(fmi2Component c, const char *name)
{
    return status(failed(c, "%s is not supported", name));
}

EXPORT const char *FMI2(fmi2GetTypesPlatform)(void) { return "default"; }
EXPORT const char *FMI2(fmi2GetVersion)(void) { return "2.0"; }

EXPORT fmi2Status FMI2(fmi2SetDebugLogging)(C, fmi2Boolean on, size_t n, const fmi2String kinds[])
{
    UNUSED(c);
    UNUSED(on);
    UNUSED(n);
    UNUSED(kinds);
    return fmi2OK; /* only errors are logged, always */
}

/* ---------------------------------------------------------------- instances */
EXPORT fmi2Component FMI2(fmi2Instantiate)(fmi2String name, fmi2Type type, fmi2String guid,
                                           fmi2String resources,
                                           const fmi2CallbackFunctions *functions,
                                           fmi2Boolean visible, fmi2Boolean logging)
{
    UNUSED(resources);
    UNUSED(visible);
    UNUSED(logging);
    instance *it = calloc(1, sizeof *it);
    if (it == NULL)
        return NULL;
    it->tell = tell;
    if (functions != NULL) {
        it->logger = (void (*)(void))functions->logger;
        it->environment = functions->componentEnvironment;
    }
    it->name = calloc(1, name == NULL ? 1 : strlen(name) + 1);
    if (it->name != NULL && name != NULL)
        strcpy(it->name, name);
    bool fine = it->name != NULL;
    if (fine && (guid == NULL || strcmp(guid, TOKEN) != 0))
        fine = failed(it, "the GUID is not that of these sources");
    if (fine && type == fmi2ModelExchange && !HAS_EXCHANGE)
        fine = failed(it, "there is no Model Exchange in this FMU; its documentation says why");
    if (!fine) {
        free(it->name);
        free(it);
        return NULL;
    }
    it->now.exchange = type == fmi2ModelExchange;
    reset(it);
    return it;
}

EXPORT void FMI2(fmi2FreeInstance)(C)
{
    if (c != NULL)
        free(((instance *)c)->name);
    free(c);
}

EXPORT fmi2Status FMI2(fmi2SetupExperiment)(C, fmi2Boolean tolerant, fmi2Real tolerance,
                                            fmi2Real start, fmi2Boolean ends, fmi2Real stop)
{
    UNUSED(tolerant);
    UNUSED(tolerance);
    UNUSED(ends);
    UNUSED(stop);
    instance *it = c;
    if (it->now.mode != INSTANTIATED)
        return status(failed(it, "fmi2SetupExperiment comes before the initialization"));
    it->now.start = start;
    return fmi2OK;
}

EXPORT fmi2Status FMI2(fmi2EnterInitializationMode)(C)
{
    instance *it = c;
    return status(begin(it, it->now.start));
}

EXPORT fmi2Status FMI2(fmi2ExitInitializationMode)(C)
{
    instance *it = c;
    if (it->now.mode != INITIALIZING)
        return status(failed(it, "the initialization has not begun"));
    it->now.mode = it->now.exchange ? EVENTS : STEPPING;
    return fmi2OK;
}

EXPORT fmi2Status FMI2(fmi2Terminate)(C)
{
    ((instance *)c)->now.mode = TERMINATED;
    return fmi2OK;
}

EXPORT fmi2Status FMI2(fmi2Reset)(C)
{
    reset(c);
    return fmi2OK;
}

/* ---------------------------------------------------------------- values */
EXPORT fmi2Status FMI2(fmi2GetReal)(C, REFERENCES, fmi2Real values[])
{
    for (size_t k = 0; k < n; k++)
        if (!get_number(c, vr[k], &values[k]))
            return fmi2Error;
    return fmi2OK;
}

EXPORT fmi2Status FMI2(fmi2GetInteger)(C, REFERENCES, fmi2Integer values[])
{
    for (size_t k = 0; k < n; k++) {
        int64_t value = 0;
        if (!get_count(c, vr[k], &value))
            return fmi2Error;
        values[k] = (fmi2Integer)value;
    }
    return fmi2OK;
}

EXPORT fmi2Status FMI2(fmi2GetBoolean)(C, REFERENCES, fmi2Boolean values[])
{
    UNUSED(vr);
    UNUSED(values);
    return n == 0 ? fmi2OK : unsupported(c, "fmi2GetBoolean");
}

EXPORT fmi2Status FMI2(fmi2GetString)(C, REFERENCES, fmi2String values[])
{
    UNUSED(vr);
    UNUSED(values);
    return n == 0 ? fmi2OK : unsupported(c, "fmi2GetString");
}

EXPORT fmi2Status FMI2(fmi2SetReal)(C, REFERENCES, const fmi2Real values[])
{
    for (size_t k = 0; k < n; k++)
        if (!set_number(c, vr[k], values[k]))
            return fmi2Error;
    return fmi2OK;
}

EXPORT fmi2Status FMI2(fmi2SetInteger)(C, REFERENCES, const fmi2Integer values[])
{
    for (size_t k = 0; k < n; k++)
        if (!set_count(c, vr[k], values[k]))
            return fmi2Error;
    return fmi2OK;
}

EXPORT fmi2Status FMI2(fmi2SetBoolean)(C, REFERENCES, const fmi2Boolean values[])
{
    UNUSED(vr);
    UNUSED(values);
    return n == 0 ? fmi2OK : unsupported(c, "fmi2SetBoolean");
}

EXPORT fmi2Status FMI2(fmi2SetString)(C, REFERENCES, const fmi2String values[])
{
    UNUSED(vr);
    UNUSED(values);
    return n == 0 ? fmi2OK : unsupported(c, "fmi2SetString");
}

EXPORT fmi2Status FMI2(fmi2GetDirectionalDerivative)(C, const fmi2ValueReference unknown[], size_t nu,
                                                     const fmi2ValueReference known[], size_t nk,
                                                     const fmi2Real dk[], fmi2Real du[])
{
    UNUSED(unknown);
    UNUSED(nu);
    UNUSED(known);
    UNUSED(nk);
    UNUSED(dk);
    UNUSED(du);
    return unsupported(c, "fmi2GetDirectionalDerivative");
}

/* ---------------------------------------------------------------- saved states */
EXPORT fmi2Status FMI2(fmi2GetFMUstate)(C, fmi2FMUstate *saved) { return status(save(c, saved)); }
EXPORT fmi2Status FMI2(fmi2SetFMUstate)(C, fmi2FMUstate saved) { return status(restore(c, saved)); }

EXPORT fmi2Status FMI2(fmi2FreeFMUstate)(C, fmi2FMUstate *saved)
{
    UNUSED(c);
    if (saved != NULL) {
        free(*saved);
        *saved = NULL;
    }
    return fmi2OK;
}

EXPORT fmi2Status FMI2(fmi2SerializedFMUstateSize)(C, fmi2FMUstate saved, size_t *size)
{
    UNUSED(c);
    UNUSED(saved);
    *size = sizeof(changing);
    return fmi2OK;
}

EXPORT fmi2Status FMI2(fmi2SerializeFMUstate)(C, fmi2FMUstate saved, fmi2Byte bytes[], size_t size)
{
    return status(serialize(c, saved, bytes, size));
}

EXPORT fmi2Status FMI2(fmi2DeSerializeFMUstate)(C, const fmi2Byte bytes[], size_t size,
                                                fmi2FMUstate *saved)
{
    return status(deserialize(c, bytes, size, saved));
}

/* ---------------------------------------------------------------- Model Exchange */
EXPORT fmi2Status FMI2(fmi2EnterEventMode)(C) { return status(enter(c, EVENTS, true)); }

EXPORT fmi2Status FMI2(fmi2NewDiscreteStates)(C, fmi2EventInfo *info)
{
    instance *it = c;
    if (it->now.mode != EVENTS)
        return status(failed(it, "fmi2NewDiscreteStates is for the event mode"));
    if (!settle_here(it))
        return fmi2Error;
    info->newDiscreteStatesNeeded = info->terminateSimulation = 0;
    info->nominalsOfContinuousStatesChanged = 0;
    info->valuesOfContinuousStatesChanged = it->now.block[MOVED].i != 0;
    info->nextEventTime = it->now.block[NEXT].f;
    info->nextEventTimeDefined = isfinite(info->nextEventTime);
    return fmi2OK;
}

EXPORT fmi2Status FMI2(fmi2EnterContinuousTimeMode)(C) { return status(enter(c, CONTINUOUS, true)); }

EXPORT fmi2Status FMI2(fmi2CompletedIntegratorStep)(C, fmi2Boolean final, fmi2Boolean *event,
                                                    fmi2Boolean *terminate)
{
    UNUSED(final);
    *event = MODEL(changed)(address(c)) != 0;
    *terminate = 0;
    return fmi2OK;
}

EXPORT fmi2Status FMI2(fmi2SetTime)(C, fmi2Real t)
{
    return status(set_time(c, t));
}

EXPORT fmi2Status FMI2(fmi2SetContinuousStates)(C, const fmi2Real x[], size_t n)
{
    return status(set_states(c, x, n));
}

EXPORT fmi2Status FMI2(fmi2GetDerivatives)(C, fmi2Real dx[], size_t n)
{
    return status(get_slopes(c, dx, n));
}

EXPORT fmi2Status FMI2(fmi2GetEventIndicators)(C, fmi2Real z[], size_t n)
{
    return status(get_indicators(c, z, n));
}

EXPORT fmi2Status FMI2(fmi2GetContinuousStates)(C, fmi2Real x[], size_t n)
{
    return status(get_states(c, x, n));
}

EXPORT fmi2Status FMI2(fmi2GetNominalsOfContinuousStates)(C, fmi2Real x[], size_t n)
{
    return status(get_nominals(c, x, n));
}

/* ---------------------------------------------------------------- Co-Simulation */
EXPORT fmi2Status FMI2(fmi2SetRealInputDerivatives)(C, REFERENCES, const fmi2Integer order[],
                                                    const fmi2Real values[])
{
    instance *it = c;
    for (size_t k = 0; k < n; k++) {
        if (vr[k] >= VARIABLES || variables[vr[k]].place != INPUT || order[k] != 1)
            return status(failed(it, "only first derivatives of inputs are taken"));
        it->now.rate[variables[vr[k]].index] = values[k];
    }
    return fmi2OK;
}

EXPORT fmi2Status FMI2(fmi2GetRealOutputDerivatives)(C, REFERENCES, const fmi2Integer order[],
                                                     fmi2Real values[])
{
    UNUSED(vr);
    UNUSED(n);
    UNUSED(order);
    UNUSED(values);
    return unsupported(c, "fmi2GetRealOutputDerivatives");
}

EXPORT fmi2Status FMI2(fmi2DoStep)(C, fmi2Real t, fmi2Real h, fmi2Boolean final)
{
    UNUSED(final);
    instance *it = c;
    if (it->now.mode != STEPPING)
        return status(failed(it, "a step before the initialization has ended, or after an error"));
    return status(step(it, t, h));
}

EXPORT fmi2Status FMI2(fmi2CancelStep)(C) { return unsupported(c, "fmi2CancelStep"); }

EXPORT fmi2Status FMI2(fmi2GetStatus)(C, const fmi2StatusKind kind, fmi2Status *value)
{
    UNUSED(c);
    UNUSED(kind);
    UNUSED(value);
    return fmi2Discard; /* no step is ever pending */
}

EXPORT fmi2Status FMI2(fmi2GetRealStatus)(C, const fmi2StatusKind kind, fmi2Real *value)
{
    if (kind != fmi2LastSuccessfulTime)
        return fmi2Discard;
    *value = ((instance *)c)->now.t;
    return fmi2OK;
}

EXPORT fmi2Status FMI2(fmi2GetIntegerStatus)(C, const fmi2StatusKind kind, fmi2Integer *value)
{
    UNUSED(c);
    UNUSED(kind);
    UNUSED(value);
    return fmi2Discard;
}

EXPORT fmi2Status FMI2(fmi2GetBooleanStatus)(C, const fmi2StatusKind kind, fmi2Boolean *value)
{
    if (kind != fmi2Terminated)
        return fmi2Discard;
    *value = ((instance *)c)->now.mode == TERMINATED;
    return fmi2OK;
}

EXPORT fmi2Status FMI2(fmi2GetStringStatus)(C, const fmi2StatusKind kind, fmi2String *value)
{
    UNUSED(c);
    UNUSED(kind);
    UNUSED(value);
    return fmi2Discard;
}
