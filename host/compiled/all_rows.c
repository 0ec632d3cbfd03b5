#include <math.h>
#include <stdint.h>

/* Rows at once: the intermediate results of one block stay in a cache, and the compiler does several at a time. */
#define BLOCK 64

enum {
    SAME, ADD, SUB, MUL, DIV, NEG, SQ, SQRT, TWICE, INV, EXP, LOG, POW, SIN, COS, TAN, TANH, FABS, SIGN,
    FMIN, FMAX, LT, LE, EQ, NE, NOT, AND, OR, IF_ELSE_ZERO
};

/* A result may take the place of its own operand, row by row, which the compiler cannot know. */
#define EACH(value)                                   \
    {                                                 \
        _Pragma("omp simd")                           \
        for (int k = 0; k < BLOCK; k++) {             \
            const double x = a[k], y = b[k];          \
            (void)y;                                  \
            z[k] = value;                             \
        }                                             \
        break;                                        \
    }

/* Carries out steps (operation, operand, operand, place) on all rows, block after block.

work      places x BLOCK, the constants in their places
given     where each given number goes, from where and how far apart its rows are, 0 if it is the same at all
results   where each result comes from; its rows in `out` are `apart` numbers apart
*/
void all_rows(intptr_t rows, intptr_t steps, const intptr_t *program, double *work, intptr_t givens,
              const intptr_t *given, const double *const *from, const intptr_t *from_apart, intptr_t results,
              const intptr_t *result, double *const *out, const intptr_t *apart)
{
    for (intptr_t first = 0; first < rows; first += BLOCK) {
        const int count = rows - first < BLOCK ? (int)(rows - first) : BLOCK;
        for (intptr_t i = 0; i < givens; i++) {
            double *z = work + given[i] * BLOCK;
            const double *x = from[i] + first * from_apart[i];
            for (int k = 0; k < BLOCK; k++)
                z[k] = x[(k < count ? k : 0) * from_apart[i]];
        }
        for (const intptr_t *step = program, *end = program + 4 * steps; step < end; step += 4) {
            const double *a = work + step[1] * BLOCK, *b = work + step[2] * BLOCK;
            double *z = work + step[3] * BLOCK;
            switch (step[0]) {
            case SAME: EACH(x);
            case ADD: EACH(x + y);
            case SUB: EACH(x - y);
            case MUL: EACH(x * y);
            case DIV: EACH(x / y);
            case NEG: EACH(-x);
            case SQ: EACH(x * x);
            case SQRT: EACH(sqrt(x));
            case TWICE: EACH(x + x);
            case INV: EACH(1.0 / x);
            case EXP: EACH(exp(x));
            case LOG: EACH(log(x));
            case POW: EACH(pow(x, y));
            case SIN: EACH(sin(x));
            case COS: EACH(cos(x));
            case TAN: EACH(tan(x));
            case TANH: EACH(tanh(x));
            case FABS: EACH(fabs(x));
            case SIGN: EACH(x < 0.0 ? -1.0 : x > 0.0 ? 1.0 : x);
            case FMIN: EACH(x < y || y != y ? x : y);
            case FMAX: EACH(x > y || y != y ? x : y);
            case LT: EACH(x < y);
            case LE: EACH(x <= y);
            case EQ: EACH(x == y);
            case NE: EACH(x != y);
            case NOT: EACH(x == 0.0);
            case AND: EACH(x != 0.0 && y != 0.0);
            case OR: EACH(x != 0.0 || y != 0.0);
            case IF_ELSE_ZERO: EACH(x != 0.0 ? y : 0.0);
            }
        }
        for (intptr_t i = 0; i < results; i++) {
            const double *x = work + result[i] * BLOCK;
            double *z = out[i] + first * apart[i];
            for (int k = 0; k < count; k++)
                z[k * apart[i]] = x[k];
        }
    }
}
