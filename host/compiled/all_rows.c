#include <math.h>
#include <stdint.h>

/* Rows at once: the intermediate results of one block stay in a cache, and the compiler does several at a time. */
#define BLOCK 64

enum {
    SAME, ADD, SUB, MUL, DIV, NEG, SQ, SQRT, TWICE, INV, EXP, LOG, POW, SIN, COS, TAN, TANH, FABS, SIGN,
    FMIN, FMAX, LT, LE, EQ, NE, NOT, AND, OR, IF_ELSE_ZERO,
    PRODUCT_PLUS, PRODUCT_MINUS, MINUS_PRODUCT
};

/* A result may take the place of its own operand, row by row, which the compiler cannot know. */
#define EACH(value)                                   \
    {                                                 \
        _Pragma("omp simd")                           \
        for (int k = 0; k < BLOCK; k++) {             \
            const double x = a[k], y = b[k], w = c[k]; \
            (void)y, (void)w;                         \
            z[k] = value;                             \
        }                                             \
        break;                                        \
    }

/* Instructions (operation, three operands, place) and what they are given.

work   places x BLOCK, the constants in their places
given  where each given number goes, from where and how far apart its rows are, 0 if it is the same at all
*/
typedef struct {
    intptr_t steps;
    const int32_t *program;
    double *work;
    intptr_t givens;
    const intptr_t *given;
    const double *const *from;
    const intptr_t *apart;
} Part;

/* Carries them out on the rows of one block from `first`, of which there are `count`. */
static void over_block(const Part *part, intptr_t first, int count)
{
    double *work = part->work;
    for (intptr_t i = 0; i < part->givens; i++) {
        const intptr_t apart = part->apart[i];
        double *z = work + part->given[i] * BLOCK;
        const double *x = part->from[i] + first * apart;
        for (int k = 0; k < BLOCK; k++)
            z[k] = x[(k < count ? k : 0) * apart];
    }
    for (const int32_t *step = part->program, *end = step + 5 * part->steps; step < end; step += 5) {
        const double *a = work + (intptr_t)step[1] * BLOCK, *b = work + (intptr_t)step[2] * BLOCK;
        const double *c = work + (intptr_t)step[3] * BLOCK;
        double *z = work + (intptr_t)step[4] * BLOCK;
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
        case PRODUCT_PLUS: EACH(x * y + w);
        case PRODUCT_MINUS: EACH(x * y - w);
        case MINUS_PRODUCT: EACH(w - x * y);
        }
    }
}

static int block_at(intptr_t first, intptr_t rows) { return rows - first < BLOCK ? (int)(rows - first) : BLOCK; }

/* The results: where each comes from, and where it goes; its rows there are `apart` numbers apart. */
void all_rows(intptr_t rows, const Part *part, intptr_t results, const intptr_t *result, double *const *out,
              const intptr_t *apart)
{
    for (intptr_t first = 0; first < rows; first += BLOCK) {
        const int count = block_at(first, rows);
        over_block(part, first, count);
        for (intptr_t i = 0; i < results; i++) {
            const double *x = part->work + result[i] * BLOCK;
            double *z = out[i] + first * apart[i];
            for (int k = 0; k < count; k++)
                z[k * apart[i]] = x[k];
        }
    }
}
