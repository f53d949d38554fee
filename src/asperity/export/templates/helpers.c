static inline real @max(real a, real b)
{
    return b > a ? b : a;
}

static inline real @min(real a, real b)
{
    return b < a ? b : a;
}

static inline int64_t @max_int(int64_t a, int64_t b)
{
    return b > a ? b : a;
}

static inline int64_t @min_int(int64_t a, int64_t b)
{
    return b < a ? b : a;
}

static inline int64_t @abs_int(int64_t a)
{
    return a < 0 ? -a : a;
}

static inline int64_t @floor(real x)
{
    const int64_t whole = (int64_t)x;
    return whole - (x < (real)whole);
}

static inline int64_t @ceil(real x)
{
    const int64_t whole = (int64_t)x;
    return whole + (x > (real)whole);
}

static inline int64_t @round(real x)
{
    return (int64_t)rint!(x);
}

static inline int64_t @quotient_int(int64_t a, int64_t b)
{
    if (b == 0) {
        return 0;
    }
    return a / b - (a % b != 0 && (a < 0) != (b < 0));
}

static inline int64_t @rest_int(int64_t a, int64_t b)
{
    if (b == 0) {
        return 0;
    }
    return a % b + (a % b != 0 && (a < 0) != (b < 0) ? b : 0);
}

static inline real @quotient(real a, real b)
{
    const real rest = fmod!(a, b);
    const real change = rest != 0 && (b < 0) != (rest < 0) ? 1 : 0;
    const real whole = (a - rest) / b - change;
    const real below = floor!(whole);
    return whole - below > (real)0.5 ? below + 1 : below;
}

static inline real @rest(real a, real b)
{
    const real rest = fmod!(a, b);
    if (rest == 0) {
        return copysign!(0, b);
    }
    return (b < 0) != (rest < 0) ? rest + b : rest;
}

static inline real @power(real a, int64_t n)
{
    real result = 1;
    int64_t left = n < 0 ? -n : n;
    while (left != 0) {
        if (left & 1) {
            result *= a;
        }
        left >>= 1;
        a *= a;
    }
    return n < 0 ? 1 / result : result;
}
