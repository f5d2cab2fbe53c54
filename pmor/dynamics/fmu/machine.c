/* A gearbox in motion for co-simulation, FMI 2.0: its modes, and its meshes as tables of both forces over two coordinates
   (table.h), as pmor.dynamics.kernels.hub_table has them. A step is cut into shorter ones: half a drift of the modes,
   exact, a kick of the meshes and of what the speed adds, and another half. Modes that are kicked move, where they are, by
   less than forces would that stay on them: by share h^2 of their accelerations, which the flexibility beside them has. */
#include "table.h"

/* Inputs: speed, torques. Outputs: forces of the meshes, of the bearings along x, y and z. */
#define SETTABLE (1 + TORQUES)
#define VARIABLES (SETTABLE + MESHES + FORCES)
/* Amplitudes and velocities of the modes, approaches, turns of the shaft, length of a step; the inverse with which
   gyroscopic moments turn velocities over a step, and the angle by which the shaft turns meanwhile. */
#define TURNS (2 * MODES + SIZE)
#define STEP (TURNS + 1)
#define ANGLE (STEP + 1)
#define INVERSE (ANGLE + 1)
#define STATES (INVERSE + MODES * MODES)

#include "unit.h"

#define MOST_STEPS 40
#define FOUND 1e-13
#define NEARLY 1e-6
#define TURN 6.283185307179586
/* Steps of the cycle of the fastest mesh and of the highest mode. */
#define PER_CYCLE 128.0
#define PER_MODE 6.0
/* Of h^2: at a kick, and at the ends of a step. */
#define AT_KICK (1.0 / 12.0)
#define AT_END (-1.0 / 24.0)

static void hermite(double t, double h[8])
{
    double s = 1.0 - t;
    h[0] = (1.0 + 2.0 * t) * s * s; h[1] = t * s * s; h[2] = t * t * (3.0 - 2.0 * t); h[3] = -t * t * s;
    h[4] = -6.0 * t * s; h[5] = s * (1.0 - 3.0 * t); h[6] = 6.0 * t * s; h[7] = t * (3.0 * t - 2.0);
}

/* Add a share of both forces, of their slopes by the approach and by the second coordinate, in a cell of a phase. */
static void cell(const float *values, double share, double t, double u, int i, int j, double t_rate, double u_rate,
                 double out[2][3])
{
    double h[8], k[8];
    int a, b, c;
    hermite(t, h);
    hermite(u, k);
    for (c = 0; c < 2; ++c) {
        double force = 0.0, by_t = 0.0, by_u = 0.0;
        for (a = 0; a < 2; ++a)
            for (b = 0; b < 2; ++b) {
                const float *node = values + 4 * (c + 2 * (j + b + TILTS * (i + a)));
                double plain = k[2 * b] * node[0] + k[2 * b + 1] * node[2];
                double turned = k[2 * b] * node[1] + k[2 * b + 1] * node[3];
                force += h[2 * a] * plain + h[2 * a + 1] * turned;
                by_t += h[4 + 2 * a] * plain + h[5 + 2 * a] * turned;
                by_u += h[2 * a] * (k[4 + 2 * b] * node[0] + k[5 + 2 * b] * node[2]);
                by_u += h[2 * a + 1] * (k[4 + 2 * b] * node[1] + k[5 + 2 * b] * node[3]);
            }
        out[c][0] += share * force;
        out[c][1] += share * t_rate * by_t;
        out[c][2] += share * u_rate * by_u;
    }
}

/* Forces of the flanks on one side at a place of their phases, and slopes; 0 beyond the table. */
static int flank_forces(int mesh, double place, double x, double u, double out[2][3])
{
    double root, t, v, t_rate, u_rate, before = floor(place);
    int i, j, first = (int)before % PHASES;
    const size_t phase = (size_t)APPROACHES * TILTS * 8;
    memset(out, 0, 6 * sizeof(double));
    if (x <= LOW[mesh]) return 1;
    if (!(x <= LOW[mesh] + SPAN[mesh] && fabs(u - MIDDLE[mesh]) <= TILT[mesh])) return 0;
    root = sqrt((x - LOW[mesh]) / SPAN[mesh]);
    t = (APPROACHES - 1) * root;
    v = (TILTS - 1) * (0.5 + 0.5 * (u - MIDDLE[mesh]) / TILT[mesh]);
    i = (int)t < APPROACHES - 2 ? (int)t : APPROACHES - 2;
    j = (int)v < TILTS - 2 ? (int)v : TILTS - 2;
    t_rate = 0.5 * (APPROACHES - 1) / (SPAN[mesh] * root);
    u_rate = 0.5 * (TILTS - 1) / TILT[mesh];
    cell(VALUES[mesh] + first * phase, 1.0 - (place - before), t - i, v - j, i, j, t_rate, u_rate, out);
    cell(VALUES[mesh] + (first + 1) % PHASES * phase, place - before, t - i, v - j, i, j, t_rate, u_rate, out);
    if (out[0][0] <= 0.0) memset(out, 0, 6 * sizeof(double)); /* flanks do not pull */
    return 1;
}

/* Forces of a mesh at a place of its cycle; backs of teeth are the flanks after half a turn about the line of centres. */
static int table_forces(int mesh, double cycle, double x, double u, double out[2][3])
{
    double place = PHASES * (cycle - floor(cycle));
    int known;
    if (x > -0.5 * BACKLASH[mesh]) return flank_forces(mesh, place, x, u, out);
    known = flank_forces(mesh, PHASES - place, -x - BACKLASH[mesh], u, out);
    out[0][0] = -out[0][0];
    out[0][2] = -out[0][2];
    out[1][1] = -out[1][1];
    return known;
}

/* Solve a system of SIZE equations, the right side in the last column. */
static void eliminate(double matrix[SIZE][SIZE + 1])
{
    int i, j, k;
    for (k = 0; k < SIZE; ++k) {
        int pivot = k;
        for (i = k + 1; i < SIZE; ++i)
            if (fabs(matrix[i][k]) > fabs(matrix[pivot][k])) pivot = i;
        for (j = 0; j <= SIZE; ++j) {
            double kept = matrix[k][j];
            matrix[k][j] = matrix[pivot][j];
            matrix[pivot][j] = kept;
        }
        for (j = SIZE; j >= k; --j) matrix[k][j] /= matrix[k][k];
        for (i = 0; i < SIZE; ++i)
            if (i != k)
                for (j = SIZE; j >= k; --j) matrix[i][j] -= matrix[i][k] * matrix[k][j];
    }
}

/* What the meshes do beside the tangents that close them, G, and their approaches x, where modes move y. */
static int closed_forces(double turns, double share, const double y[SIZE], double x[SIZE], double force[SIZE])
{
    double change = 0.0, scale = 0.0;
    int step, m, a, b, c;
    for (step = 0; step < MOST_STEPS; ++step) {
        double beyond[SIZE][SIZE], matrix[SIZE][SIZE + 1];
        for (a = 0; a < SIZE; ++a) {
            force[a] = 0.0;
            for (b = 0; b < SIZE; ++b) {
                beyond[a][b] = -TANGENT[a][b];
                force[a] -= TANGENT[a][b] * (x[b] - CENTRE[b]);
            }
        }
        for (m = 0; m < MESHES; ++m) {
            double one[2][3];
            if (!table_forces(m, AHEAD[m] + RATE[m] * turns, x[2 * m], x[2 * m + 1], one)) return 0;
            for (c = 0; c < 2; ++c) {
                force[2 * m + c] += one[c][0];
                beyond[2 * m + c][2 * m] += one[c][1];
                beyond[2 * m + c][2 * m + 1] += one[c][2];
            }
        }
        change = scale = 0.0;
        for (a = 0; a < SIZE; ++a) {
            matrix[a][SIZE] = y[a] - x[a];
            for (b = 0; b < SIZE; ++b) {
                matrix[a][SIZE] -= (RESIDUAL[a][b] + share * MOBILITY[a][b]) * (force[b] - LOAD[b]);
                matrix[a][b] = a == b;
                for (c = 0; c < SIZE; ++c) matrix[a][b] += (RESIDUAL[a][c] + share * MOBILITY[a][c]) * beyond[c][b];
            }
        }
        eliminate(matrix);
        for (a = 0; a < SIZE; ++a) {
            x[a] += matrix[a][SIZE];
            change = fmax(change, fabs(matrix[a][SIZE]));
            scale = fmax(scale, fabs(x[a]));
        }
        if (change <= FOUND * scale) return 1;
    }
    return change <= NEARLY * scale; /* between both sides of a kink */
}

static double by_torques(const Unit *unit, const double row[TORQUES])
{
    double found = 0.0;
    int a;
    for (a = 0; a < TORQUES; ++a) found += 1e3 * row[a] * unit->value[1 + a];
    return found;
}

static fmi2Status meshes(Unit *unit, double share, double force[SIZE])
{
    double y[SIZE], *z = unit->state, *x = z + 2 * MODES;
    int a, k;
    share *= z[STEP] * z[STEP];
    for (a = 0; a < SIZE; ++a) {
        y[a] = CENTRE[a] + by_torques(unit, BY_TORQUES[a]);
        for (k = 0; k < MODES; ++k) y[a] += BY_MODES[a][k] * (z[k] + share * by_torques(unit, TORQUE_ON_MODES[k]));
    }
    if (closed_forces(z[TURNS], share, y, x, force)) return fmi2OK;
    return say(unit, fmi2Error, "after %g turns: a mesh leaves the range of its table, or no force is found", z[TURNS]);
}

/* Accelerations of the modes by meshes and torques. */
static void push(const Unit *unit, const double force[SIZE], double on[MODES])
{
    int a, k;
    for (k = 0; k < MODES; ++k) {
        on[k] = by_torques(unit, TORQUE_ON_MODES[k]);
        for (a = 0; a < SIZE; ++a) on[k] -= BY_MODES[a][k] * (force[a] - LOAD[a]);
    }
}

static fmi2Status update(Unit *unit)
{
    double force[SIZE], on[MODES], *z = unit->state, *x = z + 2 * MODES, *out = unit->value + SETTABLE;
    int a, b, k;
    if (unit->known) return fmi2OK;
    if (meshes(unit, AT_END, force) != fmi2OK) return fmi2Error;
    push(unit, force, on);
    for (a = 0; a < MESHES; ++a) {
        out[a] = force[2 * a];
        for (b = 0; b < SIZE; ++b) out[a] += TANGENT[2 * a][b] * (x[b] - CENTRE[b]);
    }
    for (a = 0; a < FORCES; ++a) {
        out[MESHES + a] = by_torques(unit, FORCE_BY_TORQUES[a]);
        for (k = 0; k < MODES; ++k) out[MESHES + a] += FORCE_BY_MODES[a][k] * (z[k] + AT_END * z[STEP] * z[STEP] * on[k]);
        for (b = 0; b < SIZE; ++b) out[MESHES + a] += FORCE_BY_MESHES[a][b] * (force[b] - LOAD[b]);
    }
    unit->known = 1;
    return fmi2OK;
}

static void begin(Unit *unit)
{
    int k;
    unit->value[0] = SPEED_START;
    memcpy(unit->state + 2 * MODES, CENTRE, sizeof CENTRE);
    for (k = 0; k < MODES; ++k) unit->state[INVERSE + k * (MODES + 1)] = 1.0;
}

static double fastest(void)
{
    double found = 0.0;
    int a;
    for (a = 0; a < MESHES; ++a) found = fmax(found, fabs(RATE[a]));
    return found;
}

static double highest(void)
{
    double found = 0.0;
    int k;
    for (k = 0; k < MODES; ++k) found = fmax(found, OMEGA[k]);
    return found;
}

static fmi2Status check(Unit *unit, unsigned int variable, double value)
{
    if (variable > 0) return fmi2OK;
    if (value < 0.0) return say(unit, fmi2Error, "speed of %g rad/s: below zero", value);
    if (value * fastest() > highest()) return say(unit, fmi2Error, "speed of %g rad/s: a mesh beyond all modes", value);
    return fmi2OK;
}

static void drift(Unit *unit, double h)
{
    double *z = unit->state, *v = z + MODES;
    int k;
    for (k = 0; k < MODES; ++k) {
        double w = OMEGA[k], r = RATIO[k], damped = w * sqrt(1.0 - r * r), decay = exp(-r * w * h);
        double cosine = decay * cos(damped * h), sine = decay * sin(damped * h) / damped, moved = z[k];
        z[k] = (cosine + r * w * sine) * moved + sine * v[k];
        v[k] = -w * w * sine * moved + (cosine - r * w * sine) * v[k];
    }
}

/* Find (1 + angle G / 2)^-1: G is skew, so that no pivots are asked for. */
static void turn_velocities(double *inverse, double angle)
{
    int i, j, k;
    for (i = 0; i < MODES; ++i)
        for (j = 0; j < MODES; ++j) inverse[i * MODES + j] = (i == j) + 0.5 * angle * GYROSCOPIC[i][j];
    for (k = 0; k < MODES; ++k) {
        double *row = inverse + k * MODES, pivot = 1.0 / row[k];
        row[k] = 1.0;
        for (j = 0; j < MODES; ++j) row[j] *= pivot;
        for (i = 0; i < MODES; ++i)
            if (i != k) {
                double *other = inverse + i * MODES, factor = other[k];
                other[k] = 0.0;
                for (j = 0; j < MODES; ++j) other[j] -= factor * row[j];
            }
    }
}

/* Velocities after a step h of forces that stay and of gyroscopic moments, by the midpoint rule. */
static void kick(Unit *unit, double h, double speed, const double force[SIZE])
{
    double *z = unit->state, *v = z + MODES, *inverse = z + INVERSE, pushed[MODES];
    int k, j;
    push(unit, force, pushed);
    for (k = 0; k < MODES; ++k) {
        for (j = 0; j < MODES; ++j) pushed[k] -= speed * speed * CENTRIFUGAL[k][j] * z[j];
        pushed[k] = 2.0 * v[k] + h * pushed[k];
    }
    for (k = 0; k < MODES; ++k) {
        v[k] = -v[k];
        for (j = 0; j < MODES; ++j) v[k] += inverse[k * MODES + j] * pushed[j];
    }
}

static fmi2Status advance(Unit *unit, double step)
{
    double force[SIZE], *state = unit->state, speed = unit->value[0], h;
    long count, n;
    count = (long)ceil(step / TURN * fmax(PER_MODE * highest(), PER_CYCLE * fastest() * speed) - 1e-9);
    if (count < 1) count = 1;
    state[STEP] = h = step / count;
    if (state[ANGLE] != h * speed) {
        state[ANGLE] = h * speed;
        turn_velocities(state + INVERSE, state[ANGLE]);
    }
    for (n = 0; n < count; ++n) {
        drift(unit, 0.5 * h);
        state[TURNS] += 0.5 * h * speed / TURN;
        if (meshes(unit, AT_KICK, force) != fmi2OK) return fmi2Error;
        kick(unit, h, speed, force);
        drift(unit, 0.5 * h);
        state[TURNS] += 0.5 * h * speed / TURN;
    }
    unit->known = 0;
    return fmi2OK;
}
