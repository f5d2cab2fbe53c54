/* Mesh of a gear pair for co-simulation, FMI 2.0. The force law is a table (table.h): nothing else is needed on the
   target. Types and functions are those of the standard; they are declared here so that the source stands alone. */
#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "table.h"

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

/* In the order of the variables of modelDescription.xml. */
enum {
    PHI_1, PHI_2, AXIS_X, AXIS_Y, BACKLASH,
    TORQUE_1, TORQUE_2, FORCE, LEAD, STIFFNESS,
    PINION_X, PINION_Y, PINION_Z, WHEEL_X, WHEEL_Y, WHEEL_Z,
    VARIABLES
};
#define SETTABLE TORQUE_1

typedef struct {
    double value[VARIABLES];
    int known; /* whether the outputs are those of the inputs */
    double time;
    char *name;
    fmi2CallbackLogger logger;
    fmi2ComponentEnvironment environment;
} Mesh;

static void cubics(double t, double value[4], double slope[4])
{
    double a = t, b = 3.0 * t - 1.0, c = 3.0 * t - 2.0, d = t - 1.0;
    value[0] = -0.5 * b * c * d;
    value[1] = 4.5 * a * c * d;
    value[2] = -4.5 * a * b * d;
    value[3] = 0.5 * a * b * c;
    slope[0] = -0.5 * (3.0 * c * d + 3.0 * b * d + b * c);
    slope[1] = 4.5 * (c * d + 3.0 * a * d + a * c);
    slope[2] = -4.5 * (b * d + 3.0 * a * d + a * b);
    slope[3] = 0.5 * (b * c + 3.0 * a * c + 3.0 * a * b);
}

/* Force, N, and its derivative, N/mm, at a phase (period 1) and a displacement, mm; 0 beyond the table. */
static int flank_force(double phase, double displacement, double *force, double *stiffness)
{
    double x = (displacement - LOW) / (HIGH - LOW), t, u, rate = ROWS / (HIGH - LOW);
    double over_t[4], over_u[4], unused[4], slope[4];
    int column, row, node, i, j;
    const float *values;
    *force = *stiffness = 0.0;
    if (x < 0.0) return 1;
    if (!(x <= 1.0) || !isfinite(phase)) return 0;
    t = COLUMNS * (phase - floor(phase));
    column = (int)t;
    t -= column;
    row = (int)(ROWS * x);
    if (row > ROWS - 1) row = ROWS - 1;
    u = ROWS * x - row;
    node = (column % COLUMNS) * ROWS + row;
    while (KIND[node] != 2) {
        double *place = KIND[node] ? &u : &t;
        int upper = *place >= 0.5;
        if (KIND[node]) rate *= 2.0;
        *place = 2.0 * *place - upper;
        node = NEXT[node] + upper;
    }
    values = VALUES[NEXT[node]];
    cubics(t, over_t, unused);
    cubics(u, over_u, slope);
    for (i = 0; i < 4; ++i)
        for (j = 0; j < 4; ++j) {
            *force += over_t[i] * values[4 * i + j] * over_u[j];
            *stiffness += over_t[i] * values[4 * i + j] * slope[j];
        }
    *stiffness *= rate;
    return 1;
}

/* A message whole, since not every importer puts numbers into one. */
static fmi2Status say(Mesh *mesh, fmi2Status status, const char *text, double number)
{
    char message[200];
    snprintf(message, sizeof message, text, number);
    if (mesh->logger) mesh->logger(mesh->environment, mesh->name, status, "logStatusError", message);
    return status;
}

/* Everything follows from the inputs alone. */
static fmi2Status update(Mesh *mesh)
{
    double *v = mesh->value, c = cos(WORKING_ANGLE), s = sin(WORKING_ANGLE);
    double away = 1e3 * c * v[AXIS_X], up = 1e3 * s * v[AXIS_Y];
    double advance = BASE_1 * v[PHI_1] + BASE_2 * v[PHI_2], phase = -v[PHI_2] * BASE_2 / BASE_1 * TEETH_1 / TURN;
    double front, back = 0.0, along, across, axial, k_front, k_back = 0.0;
    if (mesh->known) return fmi2OK;
    if (!flank_force(phase, advance + away - up, &front, &k_front))
        return say(mesh, fmi2Error, "displacement along the line of action of %g mm: the table of the working flanks "
                   "ends at " HIGH_TEXT " mm", advance + away - up);
    if (BACKS) {
        double gap = 1e3 * v[BACKLASH];
        if (!flank_force(gap * TEETH_1 / TURN / BASE_1 - phase, -advance - gap - away - up, &back, &k_back))
            return say(mesh, fmi2Error, "displacement along the line of action of %g mm: the table of the backs of the "
                       "teeth ends " HIGH_TEXT " mm beyond the backlash", advance);
    }
    along = front - back;
    across = front + back;
    axial = along * TAN_BASE_HELIX;
    v[FORCE] = along;
    v[LEAD] = 1e-3 * advance;
    v[STIFFNESS] = 1e3 * (k_front + k_back);
    v[TORQUE_1] = -1e-3 * along * BASE_1;
    v[TORQUE_2] = -1e-3 * along * BASE_2;
    v[WHEEL_X] = -along * c;
    v[WHEEL_Y] = across * s;
    v[WHEEL_Z] = -axial;
    v[PINION_X] = -v[WHEEL_X];
    v[PINION_Y] = -v[WHEEL_Y];
    v[PINION_Z] = -v[WHEEL_Z];
    mesh->known = 1;
    return fmi2OK;
}

static void start(Mesh *mesh)
{
    memset(mesh->value, 0, sizeof mesh->value);
    mesh->value[BACKLASH] = BACKLASH_START;
    mesh->known = 0;
    mesh->time = 0.0;
}

EXPORT const char *fmi2GetTypesPlatform(void) { return "default"; }
EXPORT const char *fmi2GetVersion(void) { return "2.0"; }

EXPORT fmi2Component fmi2Instantiate(
    fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources, const fmi2CallbackFunctions *functions,
    fmi2Boolean visible, fmi2Boolean logging)
{
    Mesh *mesh;
    (void)resources; (void)visible; (void)logging;
    if (type != fmi2CoSimulation || !functions) return NULL;
    mesh = calloc(1, sizeof *mesh);
    if (!mesh) return NULL;
    mesh->logger = functions->logger;
    mesh->environment = functions->componentEnvironment;
    mesh->name = calloc(1, strlen(name ? name : "") + 1);
    if (mesh->name) strcpy(mesh->name, name ? name : "");
    start(mesh);
    if (mesh->name && guid && strcmp(guid, GUID) == 0) return mesh;
    say(mesh, fmi2Error, "the guid of modelDescription.xml is not that of this code", 0.0);
    free(mesh->name);
    free(mesh);
    return NULL;
}

EXPORT void fmi2FreeInstance(fmi2Component instance)
{
    if (!instance) return;
    free(((Mesh *)instance)->name);
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
    ((Mesh *)m)->time = begin;
    return fmi2OK;
}

EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component m) { (void)m; return fmi2OK; }
EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component m) { return update(m); }
EXPORT fmi2Status fmi2Terminate(fmi2Component m) { (void)m; return fmi2OK; }
EXPORT fmi2Status fmi2Reset(fmi2Component m) { start(m); return fmi2OK; }

EXPORT fmi2Status fmi2GetReal(fmi2Component m, const fmi2ValueReference vr[], size_t n, fmi2Real value[])
{
    Mesh *mesh = m;
    size_t i;
    for (i = 0; i < n; ++i) {
        if (vr[i] >= VARIABLES) return say(mesh, fmi2Error, "there is no variable %g", vr[i]);
        if (vr[i] >= SETTABLE && update(mesh) != fmi2OK) return fmi2Error;
        value[i] = mesh->value[vr[i]];
    }
    return fmi2OK;
}

EXPORT fmi2Status fmi2SetReal(fmi2Component m, const fmi2ValueReference vr[], size_t n, const fmi2Real value[])
{
    Mesh *mesh = m;
    size_t i;
    for (i = 0; i < n; ++i) {
        if (vr[i] >= SETTABLE) return say(mesh, fmi2Error, "variable %g is no input", vr[i]);
        if (!isfinite(value[i])) return say(mesh, fmi2Error, "input %g is set to what is no finite number", vr[i]);
        if (vr[i] == BACKLASH && value[i] < 0.0) return say(mesh, fmi2Error, "backlash of %g m: below zero", value[i]);
        mesh->value[vr[i]] = value[i];
        mesh->known = 0;
    }
    return fmi2OK;
}

EXPORT fmi2Status fmi2DoStep(fmi2Component m, fmi2Real time, fmi2Real step, fmi2Boolean final)
{
    (void)final;
    ((Mesh *)m)->time = time + step;
    return update(m);
}

EXPORT fmi2Status fmi2CancelStep(fmi2Component m) { (void)m; return fmi2OK; }

EXPORT fmi2Status fmi2GetRealStatus(fmi2Component m, const fmi2StatusKind kind, fmi2Real *value)
{
    if (kind != fmi2LastSuccessfulTime) return fmi2Discard;
    *value = ((Mesh *)m)->time;
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
