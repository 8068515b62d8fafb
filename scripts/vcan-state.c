// Lets a guest kernel of User-Mode Linux before 6.14 run on processors with AMX: such a kernel hands registers back
// in a buffer that is too short there, and the host takes the whole extended state or nothing. To be preloaded.
#define _GNU_SOURCE
#include <dlfcn.h>
#include <elf.h>
#include <stdarg.h>
#include <string.h>
#include <sys/ptrace.h>
#include <sys/types.h>
#include <sys/uio.h>

long ptrace(enum __ptrace_request request, ...) {
  static long (*host)(enum __ptrace_request, ...);
  static char state[1 << 16];
  struct iovec whole = {state, sizeof state};
  va_list rest;
  va_start(rest, request);
  pid_t process = va_arg(rest, pid_t);
  void *address = va_arg(rest, void *), *data = va_arg(rest, void *);
  va_end(rest);
  if (!host) host = dlsym(RTLD_NEXT, "ptrace");
  if (request == PTRACE_SETREGSET && (long)address == NT_X86_XSTATE) {
    const struct iovec *part = data;
    if (host(PTRACE_GETREGSET, process, address, &whole) == 0 && part->iov_len < whole.iov_len) {
      memcpy(state, part->iov_base, part->iov_len);
      data = &whole;
    }
  }
  return host(request, process, address, data);
}
