/* Mesh of a gear pair for co-simulation, FMI 2.0. The force law is a table (table.h): nothing else is needed on the
   target. */
#include "table.h"

/* In the order of the variables of modelDescription.xml. */
enum {
    PHI_1, PHI_2, AXIS_X, AXIS_Y, BACKLASH,
    TORQUE_1, TORQUE_2, FORCE, LEAD, STIFFNESS,
    PINION_X, PINION_Y, PINION_Z, WHEEL_X, WHEEL_Y, WHEEL_Z,
    VARIABLES
};
#define SETTABLE TORQUE_1
#define STATES 1

#include "unit.h"

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

/* Everything follows from the inputs alone. */
static fmi2Status update(Unit *unit)
{
    double *v = unit->value, c = cos(WORKING_ANGLE), s = sin(WORKING_ANGLE);
    double away = 1e3 * c * v[AXIS_X], up = 1e3 * s * v[AXIS_Y];
    double advance = BASE_1 * v[PHI_1] + BASE_2 * v[PHI_2], phase = -v[PHI_2] * BASE_2 / BASE_1 * TEETH_1 / TURN;
    double front, back = 0.0, along, across, axial, k_front, k_back = 0.0;
    if (unit->known) return fmi2OK;
    if (!flank_force(phase, advance + away - up, &front, &k_front))
        return say(unit, fmi2Error, "displacement along the line of action of %g mm: the table of the working flanks "
                   "ends at " HIGH_TEXT " mm", advance + away - up);
    if (BACKS) {
        double gap = 1e3 * v[BACKLASH];
        if (!flank_force(gap * TEETH_1 / TURN / BASE_1 - phase, -advance - gap - away - up, &back, &k_back))
            return say(unit, fmi2Error, "displacement along the line of action of %g mm: the table of the backs of the "
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
    unit->known = 1;
    return fmi2OK;
}

static void begin(Unit *unit)
{
    unit->value[BACKLASH] = BACKLASH_START;
}

static fmi2Status check(Unit *unit, unsigned int variable, double value)
{
    if (variable == BACKLASH && value < 0.0) return say(unit, fmi2Error, "backlash of %g m: below zero", value);
    return fmi2OK;
}

static fmi2Status advance(Unit *unit, double step)
{
    (void)unit;
    (void)step;
    return fmi2OK;
}
