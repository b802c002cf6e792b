/* Random numbers, which Rust's library asks Windows for since 10 and Wine has from 9 on: for tests under an older Wine. */
#include <windows.h>
BOOLEAN NTAPI SystemFunction036(PVOID, ULONG);
__declspec(dllexport) BOOL WINAPI ProcessPrng(PBYTE data, SIZE_T length) { return SystemFunction036(data, length); }
