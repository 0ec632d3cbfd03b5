/* S[k + 1] = F[k] S[k] + G[k]: S rows x nx x columns, F rows x nx x nx, G rows x nx x given of these columns. */
void linear_recursion(long rows, long nx, long columns, long given, const double *F, const double *G, double *S)
{
    for (long k = 0; k + 1 < rows; k++) {
        const double *now = S + k * nx * columns;
        double *next = S + (k + 1) * nx * columns;
        for (long i = 0; i < nx; i++) {
            const double *slope = F + (k * nx + i) * nx, *driven = G + (k * nx + i) * given;
            double *sum = next + i * columns;
            for (long j = 0; j < columns; j++)
                sum[j] = j < given ? driven[j] : 0.0;
            for (long l = 0; l < nx; l++)
                if (slope[l] != 0.0)
                    for (long j = 0; j < columns; j++)
                        sum[j] += slope[l] * now[l * columns + j];
        }
    }
}
