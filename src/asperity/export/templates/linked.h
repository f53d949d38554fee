/* Named after the ABI: what was linked to another one does not load. */
extern @NAME@_API const int @linked@;
#if defined(__GNUC__) && !defined(@NAME@_BUILD)
__attribute__((used)) static inline int @name@_needs_abi(void)
{
    return @linked@;
}
#elif defined(_MSC_VER) && !defined(@NAME@_BUILD)
#pragma comment(linker, "/include:__imp_@linked@")
#endif
