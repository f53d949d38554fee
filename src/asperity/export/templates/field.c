
/* The header of a .field file. */
typedef struct {
    char magic[8];
    uint32_t version, byte_order;
    uint64_t file_bytes;
    uint32_t rows, width;
    uint64_t columns_offset, count, values_offset, heights_offset, json_offset;
    double x0, y0, z0, m00, m01, m10, m11, iz, margin, lift;
    int32_t levels, border;
    double q, floor;
    int32_t below;
    uint32_t stretched;
    uint64_t stretched_offset;
    double fade;
    uint64_t bricks_offset;
    double unit;
    uint32_t brick_count, excess_rows, excess_columns;
    unsigned char reserved[20];
    uint32_t checksum, header_checksum;
} @name@_field_header;

typedef char @name@_header_has_256_bytes[sizeof(@name@_field_header) == 256 ? 1 : -1];

/* Return memory for a file, and where it begins: at a large page, if it is larger than one. */
static inline void *@name@_allocate(size_t size, unsigned char **bytes)
{
    const size_t page = 2097152, step = size < page ? 64 : page;
    void *memory = size > (size_t)-1 - step ? NULL : malloc(size + step);
    if (memory != NULL) {
        *bytes = (unsigned char *)memory + (step - (uintptr_t)memory % step) % step;
#if defined(__linux__) && defined(MADV_HUGEPAGE)
        if (step == page) { /* advice: without such pages the tick only takes longer */
            (void)madvise(*bytes, size, MADV_HUGEPAGE);
        }
#endif
    }
    return memory;
}

/* Read a file into memory: a mapped one could be cut or changed by others while it is rendered. */
static inline void *@name@_read_file(const char *path, size_t *size, unsigned char **bytes)
{
    void *memory = NULL;
    long end = -1;
    FILE *file = fopen(path, "rb");
    if (file == NULL) {
        return NULL;
    }
    if (fseek(file, 0, SEEK_END) == 0) {
        end = ftell(file);
    }
    if (end > 0 && fseek(file, 0, SEEK_SET) == 0) {
        *size = (size_t)end;
        memory = @name@_allocate(*size, bytes);
        if (memory != NULL && fread(*bytes, 1, *size, file) != *size) {
            free(memory);
            memory = NULL;
        }
    }
    fclose(file);
    return memory;
}

/* CRC-32 of ISO-HDLC: polynomial 0x04C11DB7, reflected, inverted before and after. */
static inline uint32_t @name@_checksum(const unsigned char *bytes, size_t size)
{
    uint32_t table[256], value = 0xFFFFFFFFu, k;
    size_t i;
    int bit;
    for (k = 0; k < 256; k++) {
        table[k] = k;
        for (bit = 0; bit < 8; bit++) {
            table[k] = table[k] & 1u ? 0xEDB88320u ^ (table[k] >> 1) : table[k] >> 1;
        }
    }
    for (i = 0; i < size; i++) {
        value = table[(value ^ bytes[i]) & 255u] ^ (value >> 8);
    }
    return value ^ 0xFFFFFFFFu;
}

/* Whether the header describes arrays inside the file and a grid whose indices fit. */
static inline int @name@_fits(const @name@_field_header *head, size_t size)
{
    const double numbers[] = {head->m00, head->m01, head->m10, head->m11, head->iz,
                              head->z0, 1e7 * head->x0, 1e7 * head->y0, head->margin,
                              head->lift, head->floor, head->fade, head->unit};
    const uint64_t places = (uint64_t)head->rows * head->width;
    const uint32_t half = head->brick_count > 0; /* an entry of the table is of 2 x 2 columns */
    const uint64_t rows = ((uint64_t)head->rows << half) - head->excess_rows;
    const uint64_t width = ((uint64_t)head->width << half) - head->excess_columns;
    size_t i;
    for (i = 0; i < sizeof numbers / sizeof numbers[0]; i++) {
        if (!(fabs(numbers[i]) <= 1e12)) {
            return 0;
        }
    }
    return head->fade > 0 && head->stretched_offset <= size && head->stretched_offset % 8 == 0
        && head->stretched <= (size - head->stretched_offset) / 56
        && (int64_t)head->stretched < head->levels
        && head->excess_rows <= half && head->excess_columns <= half && head->unit > 0
        && head->bricks_offset <= size && head->bricks_offset % 64 == 0
        && head->brick_count <= (size - head->bricks_offset) / 64
        && (rows == 1 || rows >= 4) && width >= 4 && head->iz > 0
        && places <= 0x7FFFFFFFu && head->levels >= 3 && head->border >= 0 && head->border <= 2
        && head->below >= 1 && head->below <= head->levels - 2
        && head->columns_offset <= size && head->columns_offset % 4 == 0
        && places <= (size - head->columns_offset) / 16
        && head->values_offset <= size && head->values_offset % 4 == 0
        && head->count <= (size - head->values_offset) / 4
        && head->heights_offset >= sizeof *head && head->heights_offset <= size;
}

/* Whether every column lies inside the coefficients, and all numbers are finite. */
static inline int @name@_is_consistent(
    const @name@_field_header *head, const int32_t *columns, const float *c,
    const double *stretched_cells)
{
    const size_t places = (size_t)head->rows * head->width;
    const int64_t count = head->brick_count > 0 ? head->brick_count : (int64_t)head->count;
    size_t i;
    for (i = 0; i < places; i++) {
        const int64_t offset = columns[4 * i], first = columns[4 * i + 1];
        const int64_t end = columns[4 * i + 2], reach = columns[4 * i + 3];
        if (first < 0 || end < first || reach < 0 || reach > head->levels) {
            return 0;
        }
        if (first < end && (offset + first < 0 || offset + end > count)) {
            return 0;
        }
    }
    for (i = 0; i < (size_t)head->stretched * 7; i++) {
        if (!(fabs(stretched_cells[i]) <= 1e12)) {
            return 0;
        }
    }
    for (i = 0; i < head->count; i++) {
        if (!(fabs((double)c[i]) <= 1e30)) {
            return 0;
        }
    }
    return 1;
}

static inline int @name@_check_file(
    const unsigned char *bytes, size_t size, @name@_field_header *head)
{
    if (size < sizeof *head) {
        return @NAME@_NO_FIELD;
    }
    memcpy(head, bytes, sizeof *head);
    if (memcmp(head->magic, "ASPFIELD", 8) != 0 || head->version < 2 || head->version > 4
        || head->byte_order != 0x01020304u) {
        return @NAME@_NO_FIELD;
    }
    if (head->version == 2) { /* all cells are equally high */
        head->fade = 2.0 * head->below / head->iz;
    }
    if (head->brick_count == 0) {
        head->unit = 1.0;
    }
    if (head->file_bytes != size || head->header_checksum != @name@_checksum(bytes, 252)
        || head->checksum != @name@_checksum(bytes + sizeof *head, size - sizeof *head)
        || !@name@_fits(head, size)
        || !@name@_is_consistent(
            head, (const int32_t *)(const void *)(bytes + head->columns_offset),
            (const float *)(const void *)(bytes + head->values_offset),
            (const double *)(const void *)(bytes + head->stretched_offset))) {
        return @NAME@_DAMAGED;
    }
    return @NAME@_LOADED;
}

static inline void @name@_use(const @name@_field_header *head, unsigned char *bytes)
{
    size_t i;
    for (i = 0; i < (size_t)head->stretched * 7; i++) { /* in the precision of the program */
        double number;
        @real@ value;
        memcpy(&number, bytes + head->stretched_offset + i * sizeof number, sizeof number);
        value = (@real@)number;
        memcpy(bytes + head->stretched_offset + i * sizeof value, &value, sizeof value);
    }
    @name@_surface.stretched_cells = (const @real@ *)(const void *)(bytes + head->stretched_offset);
    @name@_surface.stretched = head->stretched;
    @name@_surface.floor = (@real@)head->floor;
    @name@_surface.fade = (@real@)head->fade;
    @name@_surface.columns = (const int32_t *)(const void *)(bytes + head->columns_offset);
    @name@_surface.c = (const float *)(const void *)(bytes + head->values_offset);
    @name@_surface.bricks = (const int16_t *)(const void *)(bytes + head->bricks_offset);
    @name@_surface.brick_count = head->brick_count;
    @name@_surface.excess_rows = head->excess_rows;
    @name@_surface.excess_columns = head->excess_columns;
    @name@_surface.unit = (@real@)head->unit;
    @name@_surface.rows = head->rows;
    @name@_surface.width = head->width;
    @name@_surface.count = (int64_t)head->count;
    @name@_surface.x0 = (@real@)head->x0;
    @name@_surface.y0 = (@real@)head->y0;
    @name@_surface.z0 = (@real@)head->z0;
    @name@_surface.m00 = (@real@)head->m00;
    @name@_surface.m01 = (@real@)head->m01;
    @name@_surface.m10 = (@real@)head->m10;
    @name@_surface.m11 = (@real@)head->m11;
    @name@_surface.iz = (@real@)head->iz;
    @name@_surface.margin = (@real@)head->margin;
    @name@_surface.lift = (@real@)head->lift;
    @name@_surface.levels = head->levels;
    @name@_surface.below = head->below;
    @name@_surface.border = head->border;
    @name@_surface.q = head->q;
}

@link@ int @name@_load(const char *path)
{
    @name@_field_header head;
    size_t size = 0;
    unsigned char *bytes = NULL;
    void *memory = NULL;
    if (path != NULL) {
        int result;
        memory = @name@_read_file(path, &size, &bytes);
        if (memory == NULL) {
            return @NAME@_NO_FILE;
        }
        result = @name@_check_file(bytes, size, &head);
        if (result != @NAME@_LOADED) {
            free(memory);
            return result;
        }
    }
    free(@name@_surface.memory);
    @name@_surface = @name@_no_field;
    if (memory != NULL) {
        @name@_use(&head, bytes);
        @name@_surface.memory = memory;
        @name@_surface.file = bytes;
        @name@_surface.used = (size_t)head.heights_offset;
    }
    return @NAME@_LOADED;
}

@link@ double @name@_q(void)
{
    return @name@_surface.q;
}
