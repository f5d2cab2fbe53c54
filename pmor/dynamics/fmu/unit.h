/* What all units for co-simulation are, FMI 2.0: types and functions of the standard, declared here so that sources stand
   alone. Whoever includes it has said VARIABLES, SETTABLE, how many of them are inputs and parameters, and STATES. */
#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
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
typedef void (*fmi2CallbackLogger)(fmi2ComponentEnvironment, fmi2String, fmi2Status, fmi2String, fmi2String, ...);
typedef void *(*fmi2CallbackAllocateMemory)(size_t, size_t);
typedef void (*fmi2CallbackFreeMemory)(void *);
typedef void (*fmi2StepFinished)(fmi2ComponentEnvironment, fmi2Status);
typedef struct {
    fmi2CallbackLogger logger;
    fmi2CallbackAllocateMemory allocateMemory;
    fmi2CallbackFreeMemory freeMemory;
    fmi2StepFinished stepFinished;
    fmi2ComponentEnvironment componentEnvironment;
} fmi2CallbackFunctions;

typedef struct {
    double value[VARIABLES];
    double state[STATES];
    int known; /* whether the outputs are those of the inputs */
    double time;
    char *name;
    fmi2CallbackLogger logger;
    fmi2ComponentEnvironment environment;
} Unit;

/* A message whole, since not every importer puts numbers into one. */
static fmi2Status say(Unit *unit, fmi2Status status, const char *text, double number)
{
    char message[200];
    snprintf(message, sizeof message, text, number);
    if (unit->logger) unit->logger(unit->environment, unit->name, status, "logStatusError", message);
    return status;
}

/* Of the unit itself: outputs from inputs and state; values and state at the start; whether a value may be set; a step. */
static fmi2Status update(Unit *unit);
static void begin(Unit *unit);
static fmi2Status check(Unit *unit, unsigned int variable, double value);
static fmi2Status advance(Unit *unit, double step);

static void start(Unit *unit)
{
    memset(unit->value, 0, sizeof unit->value);
    memset(unit->state, 0, sizeof unit->state);
    begin(unit);
    unit->known = 0;
    unit->time = 0.0;
}

EXPORT const char *fmi2GetTypesPlatform(void) { return "default"; }
EXPORT const char *fmi2GetVersion(void) { return "2.0"; }

EXPORT fmi2Component fmi2Instantiate(
    fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources, const fmi2CallbackFunctions *functions,
    fmi2Boolean visible, fmi2Boolean logging)
{
    Unit *unit;
    (void)resources; (void)visible; (void)logging;
    if (type != fmi2CoSimulation || !functions) return NULL;
    unit = calloc(1, sizeof *unit);
    if (!unit) return NULL;
    unit->logger = functions->logger;
    unit->environment = functions->componentEnvironment;
    unit->name = calloc(1, strlen(name ? name : "") + 1);
    if (unit->name) strcpy(unit->name, name ? name : "");
    start(unit);
    if (unit->name && guid && strcmp(guid, GUID) == 0) return unit;
    say(unit, fmi2Error, "the guid of modelDescription.xml is not that of this code", 0.0);
    free(unit->name);
    free(unit);
    return NULL;
}

EXPORT void fmi2FreeInstance(fmi2Component instance)
{
    if (!instance) return;
    free(((Unit *)instance)->name);
    free(instance);
}

EXPORT fmi2Status fmi2SetDebugLogging(fmi2Component m, fmi2Boolean on, size_t n, const fmi2String categories[])
{
    (void)m; (void)on; (void)n; (void)categories;
    return fmi2OK;
}

EXPORT fmi2Status fmi2SetupExperiment(
    fmi2Component m, fmi2Boolean known, fmi2Real tolerance, fmi2Real begin, fmi2Boolean ends, fmi2Real end)
{
    (void)known; (void)tolerance; (void)ends; (void)end;
    ((Unit *)m)->time = begin;
    return fmi2OK;
}

EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component m) { (void)m; return fmi2OK; }
EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component m) { return update(m); }
EXPORT fmi2Status fmi2Terminate(fmi2Component m) { (void)m; return fmi2OK; }
EXPORT fmi2Status fmi2Reset(fmi2Component m) { start(m); return fmi2OK; }

EXPORT fmi2Status fmi2GetReal(fmi2Component m, const fmi2ValueReference vr[], size_t n, fmi2Real value[])
{
    Unit *unit = m;
    size_t i;
    for (i = 0; i < n; ++i) {
        if (vr[i] >= VARIABLES) return say(unit, fmi2Error, "there is no variable %g", vr[i]);
        if (vr[i] >= SETTABLE && update(unit) != fmi2OK) return fmi2Error;
        value[i] = unit->value[vr[i]];
    }
    return fmi2OK;
}

EXPORT fmi2Status fmi2SetReal(fmi2Component m, const fmi2ValueReference vr[], size_t n, const fmi2Real value[])
{
    Unit *unit = m;
    size_t i;
    for (i = 0; i < n; ++i) {
        if (vr[i] >= SETTABLE) return say(unit, fmi2Error, "variable %g is no input", vr[i]);
        if (!isfinite(value[i])) return say(unit, fmi2Error, "input %g is set to what is no finite number", vr[i]);
        if (check(unit, vr[i], value[i]) != fmi2OK) return fmi2Error;
        unit->value[vr[i]] = value[i];
        unit->known = 0;
    }
    return fmi2OK;
}

EXPORT fmi2Status fmi2DoStep(fmi2Component m, fmi2Real time, fmi2Real step, fmi2Boolean final)
{
    Unit *unit = m;
    (void)final;
    if (advance(unit, step) != fmi2OK) return fmi2Error;
    unit->time = time + step;
    return update(unit);
}

EXPORT fmi2Status fmi2CancelStep(fmi2Component m) { (void)m; return fmi2OK; }

EXPORT fmi2Status fmi2GetRealStatus(fmi2Component m, const fmi2StatusKind kind, fmi2Real *value)
{
    if (kind != fmi2LastSuccessfulTime) return fmi2Discard;
    *value = ((Unit *)m)->time;
    return fmi2OK;
}

/* What a unit without such variables, states or derivatives answers. */
#define NOT_HERE(name, ...) EXPORT fmi2Status name(__VA_ARGS__)
#define REFS const fmi2ValueReference vr[], size_t n
NOT_HERE(fmi2GetInteger, fmi2Component m, REFS, fmi2Integer v[]) { (void)m; (void)vr; (void)v; return n ? fmi2Error : fmi2OK; }
NOT_HERE(fmi2GetBoolean, fmi2Component m, REFS, fmi2Boolean v[]) { (void)m; (void)vr; (void)v; return n ? fmi2Error : fmi2OK; }
NOT_HERE(fmi2GetString, fmi2Component m, REFS, fmi2String v[]) { (void)m; (void)vr; (void)v; return n ? fmi2Error : fmi2OK; }
NOT_HERE(fmi2SetInteger, fmi2Component m, REFS, const fmi2Integer v[]) { (void)m; (void)vr; (void)v; return n ? fmi2Error : fmi2OK; }
NOT_HERE(fmi2SetBoolean, fmi2Component m, REFS, const fmi2Boolean v[]) { (void)m; (void)vr; (void)v; return n ? fmi2Error : fmi2OK; }
NOT_HERE(fmi2SetString, fmi2Component m, REFS, const fmi2String v[]) { (void)m; (void)vr; (void)v; return n ? fmi2Error : fmi2OK; }
NOT_HERE(fmi2GetFMUstate, fmi2Component m, fmi2FMUstate *s) { (void)m; (void)s; return fmi2Error; }
NOT_HERE(fmi2SetFMUstate, fmi2Component m, fmi2FMUstate s) { (void)m; (void)s; return fmi2Error; }
NOT_HERE(fmi2FreeFMUstate, fmi2Component m, fmi2FMUstate *s) { (void)m; (void)s; return fmi2Error; }
NOT_HERE(fmi2SerializedFMUstateSize, fmi2Component m, fmi2FMUstate s, size_t *n) { (void)m; (void)s; (void)n; return fmi2Error; }
NOT_HERE(fmi2SerializeFMUstate, fmi2Component m, fmi2FMUstate s, fmi2Byte b[], size_t n) { (void)m; (void)s; (void)b; (void)n; return fmi2Error; }
NOT_HERE(fmi2DeSerializeFMUstate, fmi2Component m, const fmi2Byte b[], size_t n, fmi2FMUstate *s) { (void)m; (void)s; (void)b; (void)n; return fmi2Error; }
NOT_HERE(fmi2GetDirectionalDerivative, fmi2Component m, REFS, const fmi2ValueReference k[], size_t nk, const fmi2Real d[], fmi2Real v[]) { (void)m; (void)vr; (void)n; (void)k; (void)nk; (void)d; (void)v; return fmi2Error; }
NOT_HERE(fmi2SetRealInputDerivatives, fmi2Component m, REFS, const fmi2Integer o[], const fmi2Real v[]) { (void)m; (void)vr; (void)o; (void)v; return n ? fmi2Error : fmi2OK; }
NOT_HERE(fmi2GetRealOutputDerivatives, fmi2Component m, REFS, const fmi2Integer o[], fmi2Real v[]) { (void)m; (void)vr; (void)o; (void)v; return n ? fmi2Error : fmi2OK; }
NOT_HERE(fmi2GetStatus, fmi2Component m, const fmi2StatusKind k, fmi2Status *v) { (void)m; (void)k; (void)v; return fmi2Discard; }
NOT_HERE(fmi2GetIntegerStatus, fmi2Component m, const fmi2StatusKind k, fmi2Integer *v) { (void)m; (void)k; (void)v; return fmi2Discard; }
NOT_HERE(fmi2GetBooleanStatus, fmi2Component m, const fmi2StatusKind k, fmi2Boolean *v) { (void)m; (void)k; (void)v; return fmi2Discard; }
NOT_HERE(fmi2GetStringStatus, fmi2Component m, const fmi2StatusKind k, fmi2String *v) { (void)m; (void)k; (void)v; return fmi2Discard; }
