/*
 * What a program and a library must agree on. A new number renames @name@_abi_N of libraries, so
 * that a program that was linked to another one does not load; others ask first:
 * @name@_abi_version() == @NAME@_ABI, and @name@_state_size() bytes for each state.
 */
#define @NAME@_ABI @abi@

/* What the library holds. Within one ABI number it may grow at its end, and in no other way. */
typedef struct @name@_facts {
    uint32_t size;       /* [bytes], set by the caller: sizeof; afterwards how many were filled */
    uint32_t abi;
    uint32_t real_size;  /* of the numbers of position, force and state: 8 double, 4 float */
    uint32_t state_size; /* [bytes] */
    double stiffness;    /* k [N/m] */
    double max_depth;    /* down to which q and q_plus hold [m] */
    double q;            /* proved upper bounds; HUGE_VAL: there is none */
    double q_plus;
    double max_force;    /* greatest force on a straight scan at max_depth, with friction [N] */
    double max_press;    /* mean normal force on it [N] */
    double friction;     /* coefficient [1]; 0 as the following without friction */
    double presliding_stiffness; /* [N/m] */
    double friction_modulation;  /* [1] */
    double max_deflection;       /* of the anchor of a law with one [m] */
    int32_t holds_deeper; /* 1: q and q_plus hold at any depth and press */
    char precision[12];  /* "double", "float" */
    char content[24];    /* @NAME@_CONTENT */
    char law[64];        /* UTF-8, cut to 63 bytes */
} @name@_facts;

/* Return the ABI number. */
@link@ int @name@_abi_version(void);

/* Return the size of a state [bytes]. */
@link@ size_t @name@_state_size(void);

/*
 * Fill as many bytes of the facts as facts->size says and as there are. Returns how many, 0 and
 * nothing filled if facts->size is less than 8.
 */
@link@ uint32_t @name@_info(@name@_facts *facts);
