/* Loops over the cells of a phase that add its Jacobian to the matrix T A P of the free unknowns.

   Unknown x_j of the phase depends on free unknowns, the columns of T A P, and its equation contributes to rows of it:
   both lists are given in compressed form (pointers, then numbers and factors), so that an unknown without any is
   constrained. Entries of a cell's matrix that are zero for every state are left out: row i of it has the columns
   coupled[coupled_ptr[i]], ..., coupled[coupled_ptr[i + 1] - 1]. All functions visit the contributions in one order:
   cells, rows of the cell's matrix, their rows of T A P, columns of the cell's matrix, their columns of T A P. */

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* ufcx_tabulate_tensor_float64 of FFCx */
typedef void tabulate_tensor(double *, const double *, const double *, const double *, const int *, const uint8_t *,
                             void *);

/* Columns of every row of T A P to which the cells contribute; returns their number.
   touching: positions cell * size + i of the contributions to each row, in compressed form. */
int64_t row_patterns(int64_t rows, int32_t size, const int32_t *dofs, const int64_t *touching_ptr,
                     const int64_t *touching, const int32_t *coupled_ptr, const int32_t *coupled,
                     const int32_t *column_ptr, const int32_t *column, int32_t *marker, int64_t *row_ptr,
                     int32_t *columns)
{
  int64_t found = 0;
  for (int64_t row = 0; row < rows; ++row)
  {
    row_ptr[row] = found;
    for (int64_t t = touching_ptr[row]; t < touching_ptr[row + 1]; ++t)
    {
      const int32_t i = (int32_t)(touching[t] % size);
      const int32_t *cell = dofs + (touching[t] / size) * size;
      for (int32_t k = coupled_ptr[i]; k < coupled_ptr[i + 1]; ++k)
      {
        const int32_t x = cell[coupled[k]];
        for (int32_t q = column_ptr[x]; q < column_ptr[x + 1]; ++q)
        {
          if (marker[column[q]] == row)
            continue;
          marker[column[q]] = (int32_t)row;
          columns[found++] = column[q];
        }
      }
    }
  }
  row_ptr[rows] = found;
  return found;
}

/* Position in the data of T A P of every contribution. begin: position of each entry of touching among the
   contributions; place: work space, one entry for each column. */
int locate(int64_t rows, int32_t size, const int32_t *dofs, const int64_t *touching_ptr, const int64_t *touching,
           const int64_t *begin, const int32_t *coupled_ptr, const int32_t *coupled, const int32_t *column_ptr,
           const int32_t *column, const int32_t *indptr, const int32_t *indices, int32_t *place, int32_t *positions)
{
  for (int64_t row = 0; row < rows; ++row)
  {
    for (int32_t n = indptr[row]; n < indptr[row + 1]; ++n)
      place[indices[n]] = n;
    for (int64_t t = touching_ptr[row]; t < touching_ptr[row + 1]; ++t)
    {
      const int32_t i = (int32_t)(touching[t] % size);
      const int32_t *cell = dofs + (touching[t] / size) * size;
      int32_t *position = positions + begin[t];
      for (int32_t k = coupled_ptr[i]; k < coupled_ptr[i + 1]; ++k)
      {
        const int32_t x = cell[coupled[k]];
        for (int32_t q = column_ptr[x]; q < column_ptr[x + 1]; ++q)
          *position++ = place[column[q]];
      }
    }
  }
  return 0;
}

/* Add the Jacobian of all cells to the data of T A P. Returns 0, or 1 without memory. */
int assemble(tabulate_tensor *kernel, int64_t cells, int32_t size, const double *coefficients,
             int64_t coefficient_size, const double *constants, const double *points, const int32_t *nodes,
             int32_t nodes_per_cell, const int32_t *dofs, const int32_t *coupled_ptr, const int32_t *coupled,
             const int32_t *row_ptr, const double *row_factor, const int32_t *column_ptr, const double *column_factor,
             const int32_t *positions, double *data)
{
  double *A = malloc(sizeof(double) * size * size), *coordinates = malloc(sizeof(double) * 3 * nodes_per_cell);
  if (!A || !coordinates)
  {
    free(A);
    free(coordinates);
    return 1;
  }
  for (int64_t c = 0; c < cells; ++c)
  {
    const int32_t *cell = dofs + c * size;
    for (int32_t n = 0; n < nodes_per_cell; ++n)
      memcpy(coordinates + 3 * n, points + 3 * (int64_t)nodes[c * nodes_per_cell + n], 3 * sizeof(double));
    memset(A, 0, sizeof(double) * size * size);
    kernel(A, coefficients + c * coefficient_size, constants, coordinates, NULL, NULL, NULL);
    for (int32_t i = 0; i < size; ++i)
      for (int32_t p = row_ptr[cell[i]]; p < row_ptr[cell[i] + 1]; ++p)
        for (int32_t k = coupled_ptr[i]; k < coupled_ptr[i + 1]; ++k)
        {
          const double value = row_factor[p] * A[i * size + coupled[k]];
          const int32_t x = cell[coupled[k]];
          for (int32_t q = column_ptr[x]; q < column_ptr[x + 1]; ++q)
            data[*positions++] += value * column_factor[q];
        }
  }
  free(A);
  free(coordinates);
  return 0;
}
