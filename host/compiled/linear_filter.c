/* Columns at once, and states at most. */
#define AT_ONCE 8
#define STATES 8

/* y = c^T x, x' = F x + g v from row to row, x = 0 at the first: F rows x nx x nx, g rows x nx; v and y columns
   x rows. */
void linear_filter(long rows, long nx, long columns, const double *F, const double *g, const double *c,
                   const double *v, double *y)
{
    for (long first = 0; first < columns; first += AT_ONCE) {
        const long count = columns - first < AT_ONCE ? columns - first : AT_ONCE;
        double x[STATES][AT_ONCE] = {{0.0}}, next[STATES][AT_ONCE];
        const double *from = v + first * rows;
        double *to = y + first * rows;
        for (long k = 0; k < rows; k++) {
            double now[AT_ONCE], sum[AT_ONCE] = {0.0};
            for (long j = 0; j < AT_ONCE; j++)
                now[j] = from[(j < count ? j : 0) * rows + k];
            for (long i = 0; i < nx; i++)
                for (long j = 0; j < AT_ONCE; j++)
                    sum[j] += c[i] * x[i][j];
            for (long j = 0; j < count; j++)
                to[j * rows + k] = sum[j];
            for (long i = 0; i < nx; i++) {
                const double *slope = F + (k * nx + i) * nx, driven = g[k * nx + i];
                for (long j = 0; j < AT_ONCE; j++)
                    next[i][j] = driven * now[j];
                for (long l = 0; l < nx; l++)
                    for (long j = 0; j < AT_ONCE; j++)
                        next[i][j] += slope[l] * x[l][j];
            }
            for (long i = 0; i < nx; i++)
                for (long j = 0; j < AT_ONCE; j++)
                    x[i][j] = next[i][j];
        }
    }
}
