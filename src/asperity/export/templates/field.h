
/* Results of @name@_load. */
#define @NAME@_LOADED 0
#define @NAME@_NO_FILE 1  /* cannot be read, or is larger than memory */
#define @NAME@_NO_FIELD 2 /* not a baked field, or of another version or byte order */
#define @NAME@_DAMAGED 3  /* cut or damaged */

/*
 * Load the field of a .field file, not while the loop runs; before it the force is zero. Another
 * result than @NAME@_LOADED leaves everything as it was; NULL unloads the field.
 * The file is read into memory, and may be changed or deleted afterwards.
 */
@link@ int @name@_load(const char *path);

/* Return the characteristic number q that the file of the loaded field states, 0 without one; it is not
 * computed here: asperity show FILE computes it from the coefficients. */
@link@ double @name@_q(void);
