/* The functions of FMI 2.0 and of FMI 3.0: model.h says of which. The table has what differs in
 * name only; types are those of the standard, under shorter names. */
#include "fmu_core.h"

#if defined(__GNUC__)
#pragma GCC diagnostic ignored "-Wunused-parameter" /* an importer tells more than is needed */
#endif

/* ---------------------------------------------------------------- the table */
#if FMI_VERSION == 2
#define NAME(name) fmi2##name
#if defined(FMI2_FUNCTION_PREFIX)
#define PREFIX FMI2_FUNCTION_PREFIX
#endif
#define TOKEN_NAME "GUID"
#define COUNT_TOO
#define ONE_EACH true
#define GetNumber GetReal
#define SetNumber SetReal
#define GetCount GetInteger
#define SetCount SetInteger
#define GetSaved GetFMUstate
#define SetSaved SetFMUstate
#define FreeSaved FreeFMUstate
#define SavedSize SerializedFMUstateSize
#define SerializeSaved SerializeFMUstate
#define DeserializeSaved DeSerializeFMUstate
#define GetSlopes GetDerivatives
typedef int truth;
typedef int count;
#else
#define NAME(name) fmi3##name
#if defined(FMI3_FUNCTION_PREFIX) && !defined(FMI3_OVERRIDE_FUNCTION_PREFIX)
#define PREFIX FMI3_FUNCTION_PREFIX
#endif
#define TOKEN_NAME "instantiation token"
#define COUNT_TOO , size_t length
#define ONE_EACH (length == n || failed(c, "every variable has one value"))
#define GetNumber GetFloat64
#define SetNumber SetFloat64
#define GetCount GetInt64
#define SetCount SetInt64
#define GetSaved GetFMUState
#define SetSaved SetFMUState
#define FreeSaved FreeFMUState
#define SavedSize SerializedFMUStateSize
#define SerializeSaved SerializeFMUState
#define DeserializeSaved DeserializeFMUState
#define GetSlopes GetContinuousStateDerivatives
typedef bool truth;
typedef int64_t count;
#endif

#if !defined(PREFIX)
#define PREFIX
#endif
#define JOINED(a, b) a##b
#define JOIN(a, b) JOINED(a, b)
#define FMI(name) JOIN(PREFIX, NAME(name)) /* a prefix: several FMUs in one program */
#define QUOTED(text) #text
#define TEXT(text) QUOTED(text)
#if defined(_WIN32) || defined(__CYGWIN__)
#define EXPORT __declspec(dllexport)
#elif defined(__GNUC__)
#define EXPORT __attribute__((visibility("default")))
#else
#define EXPORT
#endif

typedef enum { DONE, WARNING, DISCARD, ERROR, FATAL, PENDING } status;
typedef const char *text;
typedef uint32_t reference;

#define C void *c
#define REFERENCES const reference vr[], size_t n

static status told(bool fine) { return fine ? DONE : ERROR; }

static status unsupported(instance *it, text name)
{
    return told(failed(it, "%s is not supported", name));
}

#define DOES(name, arguments, call)                                                                \
    EXPORT status FMI(name) arguments { return told(call); }
#define UNSUPPORTED(name, arguments)                                                               \
    EXPORT status FMI(name) arguments { return unsupported(c, TEXT(NAME(name))); }
#define NOTHING_IN(name, arguments)                                                                \
    EXPORT status FMI(name) arguments { return n == 0 ? DONE : unsupported(c, TEXT(NAME(name))); }
/* A type that no variable has. */
#define ABSENT(kind, type)                                                                         \
    NOTHING_IN(Get##kind, (C, REFERENCES, type values[] COUNT_TOO))                                \
    NOTHING_IN(Set##kind, (C, REFERENCES, const type values[] COUNT_TOO))

/* ---------------------------------------------------------------- instances */
static void free_instance(instance *it)
{
    if (it != NULL)
        free(it->name);
    free(it);
}

static instance *made(text name, text token, void *environment, void (*logger)(void),
                      void (*tell)(const instance *, text), bool exchange)
{
    instance *it = calloc(1, sizeof *it);
    if (it == NULL)
        return NULL;
    it->tell = tell;
    it->logger = logger;
    it->environment = environment;
    it->name = calloc(1, name == NULL ? 1 : strlen(name) + 1);
    if (it->name != NULL && name != NULL)
        strcpy(it->name, name);
    bool fine = it->name != NULL;
    if (fine && (token == NULL || strcmp(token, TOKEN) != 0))
        fine = failed(it, "the " TOKEN_NAME " is not that of these sources");
    if (fine && exchange && !HAS_EXCHANGE)
        fine = failed(it, "there is no Model Exchange in this FMU; its documentation says why");
    if (!fine) {
        free_instance(it);
        return NULL;
    }
    it->now.exchange = exchange;
    reset(it);
    return it;
}

EXPORT void FMI(FreeInstance)(C) { free_instance(c); }

EXPORT status FMI(SetDebugLogging)(C, truth on, size_t n, const text kinds[])
{
    return DONE; /* only errors are logged, always */
}

EXPORT status FMI(ExitInitializationMode)(C)
{
    instance *it = c;
    if (it->now.mode != INITIALIZING)
        return told(failed(it, "the initialization has not begun"));
    it->now.mode = it->now.exchange ? EVENTS : STEPPING;
    return DONE;
}

EXPORT status FMI(Terminate)(C)
{
    ((instance *)c)->now.mode = TERMINATED;
    return DONE;
}

EXPORT status FMI(Reset)(C)
{
    reset(c);
    return DONE;
}

/* ---------------------------------------------------------------- values */
EXPORT status FMI(GetNumber)(C, REFERENCES, double values[] COUNT_TOO)
{
    bool fine = ONE_EACH;
    for (size_t k = 0; fine && k < n; k++)
        fine = get_number(c, vr[k], &values[k]);
    return told(fine);
}

EXPORT status FMI(SetNumber)(C, REFERENCES, const double values[] COUNT_TOO)
{
    bool fine = ONE_EACH;
    for (size_t k = 0; fine && k < n; k++)
        fine = set_number(c, vr[k], values[k]);
    return told(fine);
}

EXPORT status FMI(GetCount)(C, REFERENCES, count values[] COUNT_TOO)
{
    bool fine = ONE_EACH;
    for (size_t k = 0; fine && k < n; k++) {
        int64_t value = 0;
        fine = get_count(c, vr[k], &value);
        if (fine)
            values[k] = (count)value;
    }
    return told(fine);
}

EXPORT status FMI(SetCount)(C, REFERENCES, const count values[] COUNT_TOO)
{
    bool fine = ONE_EACH;
    for (size_t k = 0; fine && k < n; k++)
        fine = set_count(c, vr[k], values[k]);
    return told(fine);
}

ABSENT(Boolean, truth)
ABSENT(String, text)

/* ---------------------------------------------------------------- saved states */
DOES(GetSaved, (C, void **saved), save(c, saved))
DOES(SetSaved, (C, void *saved), restore(c, saved))

EXPORT status FMI(FreeSaved)(C, void **saved)
{
    if (saved != NULL) {
        free(*saved);
        *saved = NULL;
    }
    return DONE;
}

EXPORT status FMI(SavedSize)(C, void *saved, size_t *size)
{
    *size = sizeof(changing);
    return DONE;
}

DOES(SerializeSaved, (C, void *saved, char bytes[], size_t size), serialize(c, saved, bytes, size))
DOES(DeserializeSaved, (C, const char bytes[], size_t size, void **saved),
     deserialize(c, bytes, size, saved))

/* ---------------------------------------------------------------- Model Exchange */
DOES(EnterEventMode, (C), enter(c, EVENTS, true))
DOES(EnterContinuousTimeMode, (C), enter(c, CONTINUOUS, true))

EXPORT status FMI(CompletedIntegratorStep)(C, truth final, truth *event, truth *terminate)
{
    *event = MODEL(changed)(address(c)) != 0;
    *terminate = false;
    return DONE;
}

DOES(SetTime, (C, double t), set_time(c, t))
DOES(SetContinuousStates, (C, const double x[], size_t n), set_states(c, x, n))
DOES(GetContinuousStates, (C, double x[], size_t n), get_states(c, x, n))
DOES(GetSlopes, (C, double dx[], size_t n), get_slopes(c, dx, n))
DOES(GetEventIndicators, (C, double z[], size_t n), get_indicators(c, z, n))
DOES(GetNominalsOfContinuousStates, (C, double x[], size_t n), get_nominals(c, x, n))

/* ---------------------------------------------------------------- Co-Simulation */
static bool is_stepping(instance *it)
{
    return it->now.mode == STEPPING
           || failed(it, "a step before the initialization has ended, or after an error");
}

#if FMI_VERSION == 2
/* ---------------------------------------------------------------- FMI 2.0 only */
typedef void (*Logger)(void *environment, text name, status, text category, text message, ...);
typedef struct {
    Logger logger;
    void *(*allocateMemory)(size_t, size_t);
    void (*freeMemory)(void *);
    void (*stepFinished)(void *environment, status);
    void *environment;
} callbacks;
typedef struct {
    truth needed, terminate, nominals, moved, defined;
    double next;
} event_info;
typedef enum { STEP_STATUS, PENDING_STATUS, LAST_TIME, IS_TERMINATED } status_kind;

static void tell(const instance *it, text message)
{
    if (it->logger != NULL)
        ((Logger)it->logger)(it->environment, it->name, ERROR, "logStatusError", "%s", message);
}

EXPORT text FMI(GetTypesPlatform)(void) { return "default"; }
EXPORT text FMI(GetVersion)(void) { return "2.0"; }

EXPORT void *FMI(Instantiate)(text name, int co_simulation, text guid, text resources,
                              const callbacks *given, truth visible, truth logging)
{
    if (given == NULL)
        return made(name, guid, NULL, NULL, tell, !co_simulation);
    return made(name, guid, given->environment, (void (*)(void))given->logger, tell, !co_simulation);
}

EXPORT status FMI(SetupExperiment)(C, truth tolerant, double tolerance, double start, truth ends,
                                   double stop)
{
    instance *it = c;
    if (it->now.mode != INSTANTIATED)
        return told(failed(it, "fmi2SetupExperiment comes before the initialization"));
    it->now.start = start;
    return DONE;
}

EXPORT status FMI(EnterInitializationMode)(C)
{
    return told(begin(c, ((instance *)c)->now.start));
}

EXPORT status FMI(NewDiscreteStates)(C, event_info *info)
{
    if (!settled(c, "fmi2NewDiscreteStates"))
        return ERROR;
    const word *block = ((instance *)c)->now.block;
    *info = (event_info){.moved = block[MOVED].i != 0, .next = block[NEXT].f,
                         .defined = isfinite(block[NEXT].f) != 0};
    return DONE;
}

EXPORT status FMI(SetRealInputDerivatives)(C, REFERENCES, const int order[], const double values[])
{
    instance *it = c;
    for (size_t k = 0; k < n; k++) {
        if (vr[k] >= VARIABLES || variables[vr[k]].place != INPUT || order[k] != 1)
            return told(failed(it, "only first derivatives of inputs are taken"));
        it->now.rate[variables[vr[k]].index] = values[k];
    }
    return DONE;
}

EXPORT status FMI(DoStep)(C, double t, double h, truth final)
{
    return told(is_stepping(c) && step(c, t, h));
}

/* No step is ever pending. */
#define DISCARDED(name, type)                                                                      \
    EXPORT status FMI(name)(C, const status_kind kind, type *value) { return DISCARD; }
DISCARDED(GetStatus, status)
DISCARDED(GetIntegerStatus, int)
DISCARDED(GetStringStatus, text)

EXPORT status FMI(GetRealStatus)(C, const status_kind kind, double *value)
{
    if (kind != LAST_TIME)
        return DISCARD;
    *value = ((instance *)c)->now.t;
    return DONE;
}

EXPORT status FMI(GetBooleanStatus)(C, const status_kind kind, truth *value)
{
    if (kind != IS_TERMINATED)
        return DISCARD;
    *value = ((instance *)c)->now.mode == TERMINATED;
    return DONE;
}

UNSUPPORTED(CancelStep, (C))
UNSUPPORTED(GetRealOutputDerivatives, (C, REFERENCES, const int order[], double values[]))
UNSUPPORTED(GetDirectionalDerivative, (C, const reference unknown[], size_t nu,
                                       const reference known[], size_t nk, const double dk[],
                                       double du[]))
#else
/* ---------------------------------------------------------------- FMI 3.0 only */
typedef void (*Logger)(void *environment, status, text category, text message);
typedef void (*Update)(void *environment, double t, bool set_requested, bool get_allowed,
                       bool finished, bool may_return_early, bool *early, double *early_time);
typedef void (*Callback)(void);
#define SHARED text name, text token, text resources, bool visible, bool logging

static void tell(const instance *it, text message)
{
    if (it->logger != NULL)
        ((Logger)it->logger)(it->environment, ERROR, "logStatusError", message);
}

EXPORT text FMI(GetVersion)(void) { return "3.0"; }

EXPORT void *FMI(InstantiateModelExchange)(SHARED, void *environment, Logger log)
{
    return made(name, token, environment, (void (*)(void))log, tell, true);
}

EXPORT void *FMI(InstantiateCoSimulation)(SHARED, bool event_mode, bool early,
                                          const reference required[], size_t n, void *environment,
                                          Logger log, Update update)
{
    instance *it = made(name, token, environment, (void (*)(void))log, tell, false);
    if (it != NULL)
        it->update = (void (*)(void))update;
    return it;
}

EXPORT void *FMI(InstantiateScheduledExecution)(SHARED, void *environment, Logger log,
                                                void (*clock)(void *), Callback lock,
                                                Callback unlock)
{
    if (log != NULL)
        log(environment, ERROR, "logStatusError", "there is no Scheduled Execution in this FMU");
    return NULL;
}

DOES(EnterInitializationMode, (C, bool tolerant, double tolerance, double start, bool ends,
                               double stop), begin(c, start))

EXPORT status FMI(EvaluateDiscreteStates)(C)
{
    return DONE; /* all of it happens in fmi3UpdateDiscreteStates */
}

EXPORT status FMI(UpdateDiscreteStates)(C, bool *again, bool *terminate, bool *nominals,
                                        bool *moved, bool *defined, double *next)
{
    if (!settled(c, "fmi3UpdateDiscreteStates"))
        return ERROR;
    const word *block = ((instance *)c)->now.block;
    *again = *terminate = *nominals = false;
    *moved = block[MOVED].i != 0;
    *next = block[NEXT].f;
    *defined = isfinite(*next);
    return DONE;
}

EXPORT status FMI(GetNumberOfEventIndicators)(C, size_t *n)
{
    *n = INDICATORS;
    return DONE;
}

EXPORT status FMI(GetNumberOfContinuousStates)(C, size_t *n)
{
    *n = STATES;
    return DONE;
}

DOES(EnterStepMode, (C), enter(c, STEPPING, false))

/* The importer may set the inputs at the end of the step while it is asked here, before the step:
 * then they are straight lines during it. Otherwise they keep their values. */
EXPORT status FMI(DoStep)(C, double t, double h, bool final, bool *event, bool *terminate,
                          bool *early, double *last)
{
    instance *it = c;
    *event = *terminate = *early = false;
    *last = it->now.t;
    if (!is_stepping(it))
        return ERROR;
    if (it->update != NULL && INPUTS > 0) {
        bool requested = false;
        double wanted = t;
        it->now.mode = INTERMEDIATE;
        ((Update)it->update)(it->environment, t + h, true, false, false, false, &requested, &wanted);
        it->now.mode = STEPPING;
    }
    bool fine = step(it, t, h);
    *last = it->now.t;
    return told(fine);
}

ABSENT(Float32, float)
ABSENT(Int8, int8_t)
ABSENT(UInt8, uint8_t)
ABSENT(Int16, int16_t)
ABSENT(UInt16, uint16_t)
ABSENT(Int32, int32_t)
ABSENT(UInt32, uint32_t)
ABSENT(UInt64, uint64_t)
NOTHING_IN(GetBinary, (C, REFERENCES, size_t sizes[], const uint8_t *values[], size_t length))
NOTHING_IN(SetBinary, (C, REFERENCES, const size_t sizes[], const uint8_t *const values[],
                       size_t length))
NOTHING_IN(GetClock, (C, REFERENCES, bool values[]))
NOTHING_IN(SetClock, (C, REFERENCES, const bool values[]))

#define SEEDS                                                                                      \
    (C, const reference a[], size_t na, const reference b[], size_t nb, const double seed[],      \
     size_t ns, double found[], size_t nf)
UNSUPPORTED(GetDirectionalDerivative, SEEDS)
UNSUPPORTED(GetAdjointDerivative, SEEDS)
UNSUPPORTED(GetOutputDerivatives, (C, REFERENCES, const int32_t orders[], double values[],
                                   size_t length))
UNSUPPORTED(EnterConfigurationMode, (C))
UNSUPPORTED(ExitConfigurationMode, (C))
UNSUPPORTED(GetNumberOfVariableDependencies, (C, reference vr, size_t *n))
UNSUPPORTED(GetVariableDependencies, (C, reference vr, size_t elements[], reference others[],
                                      size_t places[], int kinds[], size_t n))
UNSUPPORTED(GetIntervalDecimal, (C, REFERENCES, double intervals[], int qualifiers[]))
UNSUPPORTED(GetIntervalFraction, (C, REFERENCES, uint64_t counters[], uint64_t resolutions[],
                                  int qualifiers[]))
UNSUPPORTED(GetShiftDecimal, (C, REFERENCES, double shifts[]))
UNSUPPORTED(GetShiftFraction, (C, REFERENCES, uint64_t counters[], uint64_t resolutions[]))
UNSUPPORTED(SetIntervalDecimal, (C, REFERENCES, const double intervals[]))
UNSUPPORTED(SetIntervalFraction, (C, REFERENCES, const uint64_t counters[],
                                  const uint64_t resolutions[]))
UNSUPPORTED(SetShiftDecimal, (C, REFERENCES, const double shifts[]))
UNSUPPORTED(SetShiftFraction, (C, REFERENCES, const uint64_t counters[],
                               const uint64_t resolutions[]))
UNSUPPORTED(ActivateModelPartition, (C, reference clock, double t))
#endif
