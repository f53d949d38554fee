#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#if defined(__linux__)
#include <sys/mman.h>
#endif

/* A field in memory, and the file that holds its arrays. */
typedef struct {
    const float *c;
    const int32_t *columns;
    const int16_t *bricks;
    const @real@ *stretched_cells;
    int64_t rows, width, count, brick_count, stretched, excess_rows, excess_columns;
    @real@ x0, y0, z0, m00, m01, m10, m11, iz, margin, lift, floor, fade, unit;
    int64_t levels, below, border;
    double q;
    void *memory; /* of the file, which begins at an aligned address in it */
    const unsigned char *file;
    size_t used;
} @name@_field;

static const int32_t @name@_no_columns[16] = {0};
static const float @name@_no_values[1] = {0};
static const int16_t @name@_no_bricks[32] = {0};
static const @real@ @name@_no_stretched_cells[7] = {0};
#define @NAME@_NOTHING \
    {@name@_no_values, @name@_no_columns, @name@_no_bricks, @name@_no_stretched_cells, 1, 4, 1, 0, \
     0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 0, 0, 1, 1, 3, 1, 2, 0, NULL, NULL, 0}
static const @name@_field @name@_no_field = @NAME@_NOTHING;
static @name@_field @name@_surface = @NAME@_NOTHING;
