@note@#ifndef @NAME@_H
#define @NAME@_H

@includes@
#if defined(_WIN32) && defined(@NAME@_BUILD)
#define @NAME@_API __declspec(dllexport)
#elif defined(_WIN32)
#define @NAME@_API __declspec(dllimport)
#elif defined(__GNUC__)
#define @NAME@_API __attribute__((visibility("default")))
#else
#define @NAME@_API
#endif

#if defined(__cplusplus)
extern "C" {
#endif

@contract@

@linked_header@#if defined(__cplusplus)
}
#endif

#endif /* @NAME@_H */
