/* Slopes: (which, row, column, place) each, the first `by_state` by the state, the others by a parameter. */
typedef struct {
    intptr_t count, by_state;
    const intptr_t *entries;
} Slopes;

/* z = slopes at row k of the block, times S for those by the state; nx rows of S and all of z are `wide`. */
static void times(const Slopes *slopes, const double *work, int k, intptr_t wide, const double *S, double *z)
{
    const intptr_t *entry = slopes->entries, *end = entry + 4 * slopes->count;
    for (const intptr_t *own = entry + 4 * slopes->by_state; own < end; own += 4)
        z[own[1] * wide + own[2]] = work[own[3] * BLOCK + k];
    for (end = entry + 4 * slopes->by_state; entry < end; entry += 4) {
        const double slope = work[entry[3] * BLOCK + k], *from = S + entry[2] * wide;
        double *sum = z + entry[1] * wide;
        if (slope != 0.0)
            for (intptr_t j = 0; j < wide; j++)
                sum[j] += slope * from[j];
    }
}

/* What two sensors see of S, which goes from row to row in sub-steps, corrected by a gain before the first.

within   the sub-steps, one after the other
gains    nx x 2, column by column, x rows; or none
present  2 x rows
S        2 x nx x wide: S at the first row, and room
z        2 x wide, room
seen     2 x columns x rows
*/
void carried_slopes(intptr_t rows, intptr_t substeps, const Part *output, const Slopes *by_output,
                    const Part *within, const Slopes *by_substep, intptr_t nx, intptr_t columns, intptr_t wide,
                    const double *gains, const double *present, double *S, double *z, double *seen)
{
    double *now = S, *next = S + nx * wide;
    for (intptr_t first = 0; first < rows; first += BLOCK) {
        const int count = block_at(first, rows);
        over_block(output, first, count);
        for (intptr_t s = 0; s < substeps; s++)
            over_block(within + s, first, count);
        for (int k = 0; k < count; k++) {
            const intptr_t row = first + k;
            for (intptr_t j = 0; j < 2 * wide; j++)
                z[j] = 0.0;
            times(by_output, output->work, k, wide, now, z);
            for (intptr_t o = 0; o < 2; o++)
                for (intptr_t j = 0; j < columns; j++)
                    seen[(o * columns + j) * rows + row] = z[o * wide + j] * present[o * rows + row];
            if (gains)
                for (intptr_t o = 0; o < 2; o++)
                    for (intptr_t i = 0; i < nx; i++) {
                        const double gain = gains[(o * nx + i) * rows + row];
                        for (intptr_t j = 0; j < wide; j++)
                            now[i * wide + j] -= gain * z[o * wide + j];
                    }
            for (intptr_t s = 0; s < substeps; s++) {
                for (intptr_t j = 0; j < nx * wide; j++)
                    next[j] = 0.0;
                times(by_substep, within[s].work, k, wide, now, next);
                double *before = now;
                now = next;
                next = before;
            }
        }
    }
}
