/* What a rank of `mpirun talus` spends inside MPI: preloaded, it times the calls and writes one line at the end.

     LD_PRELOAD=libtalus_mpi_share.so MPI_SHARE_OUT=FILE     FILE.<rank>: cpu, cpu in MPI, wall in MPI [s], calls, peak of memory [MB]

   CPU of the main thread, which alone calls MPI. A rank that waits spins: its CPU time less that in MPI is what it computed. */
#define _GNU_SOURCE
#include <mpi.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/resource.h>
#include <time.h>

static double cpu_in_mpi, wall_in_mpi;
static long calls;

static double now(clockid_t clock) {
  struct timespec t;
  clock_gettime(clock, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

#define TIMED(call)                                                                    \
  const double cpu = now(CLOCK_THREAD_CPUTIME_ID), wall = now(CLOCK_MONOTONIC);        \
  const int result = call;                                                             \
  cpu_in_mpi += now(CLOCK_THREAD_CPUTIME_ID) - cpu, wall_in_mpi += now(CLOCK_MONOTONIC) - wall, ++calls; \
  return result

int MPI_Allgather(const void* s, int n, MPI_Datatype a, void* r, int m, MPI_Datatype b, MPI_Comm c) { TIMED(PMPI_Allgather(s, n, a, r, m, b, c)); }
int MPI_Allgatherv(const void* s, int n, MPI_Datatype a, void* r, const int* m, const int* at, MPI_Datatype b, MPI_Comm c) { TIMED(PMPI_Allgatherv(s, n, a, r, m, at, b, c)); }
int MPI_Irecv(void* b, int n, MPI_Datatype t, int from, int tag, MPI_Comm c, MPI_Request* r) { TIMED(PMPI_Irecv(b, n, t, from, tag, c, r)); }
int MPI_Isend(const void* b, int n, MPI_Datatype t, int to, int tag, MPI_Comm c, MPI_Request* r) { TIMED(PMPI_Isend(b, n, t, to, tag, c, r)); }
int MPI_Waitall(int n, MPI_Request r[], MPI_Status s[]) { TIMED(PMPI_Waitall(n, r, s)); }

__attribute__((destructor)) static void tell(void) {
  const char *base = getenv("MPI_SHARE_OUT"), *rank = getenv("OMPI_COMM_WORLD_RANK");
  if (!base || !rank) return;
  char name[4096];
  snprintf(name, sizeof name, "%s.%s", base, rank);
  FILE* out = fopen(name, "w");
  struct rusage use;
  getrusage(RUSAGE_SELF, &use);
  if (out) fprintf(out, "%.6f %.6f %.6f %ld %.0f\n", now(CLOCK_THREAD_CPUTIME_ID), cpu_in_mpi, wall_in_mpi, calls, (double)use.ru_maxrss * 1024e-6), fclose(out);
}
