/* Polynomials fitted to nodal values on patches of a mesh. A patch has a centre, a scale along both axes, and nodes;
   polynomials are those of the coordinates from the centre over the scales. */

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum
{
  MOST = 10 /* coefficients of a cubic */
};

/* Products z^i r^j with i + j up to the degree, i outermost. Those whose j is of the parity that is not wanted are zero;
   wanted < 0: all. Returns their number. */
static int monomials(double z, double r, int32_t degree, int32_t wanted, double *value)
{
  int found = 0;
  double z_i = 1.0;
  for (int i = 0; i <= degree; ++i, z_i *= z)
  {
    double product = z_i;
    for (int j = 0; i + j <= degree; ++j, product *= r)
      value[found++] = wanted >= 0 && j % 2 != wanted ? 0.0 : product;
  }
  return found;
}

/* Data and columns of the matrix that turns nodal values into the coefficients of the least-squares fits, of which a
   patch has one row each. only: patches to compute. Returns 0, 1 without memory, or 2 if normal equations are singular.
 */
int patch_fits(int64_t patches, const int64_t *only, const int64_t *pointer, const int32_t *nodes, const double *points,
               const double *centres, const double *scales, int32_t degree, int32_t parity, double ridge, double *fits,
               int32_t *columns)
{
  int64_t largest = 0;
  for (int64_t n = 0; n < patches; ++n)
    if (pointer[only[n] + 1] - pointer[only[n]] > largest)
      largest = pointer[only[n] + 1] - pointer[only[n]];
  double *basis = malloc(sizeof(double) * MOST * (size_t)(largest ? largest : 1));
  if (!basis)
    return 1;
  int status = 0;
  for (int64_t n = 0; n < patches && !status; ++n)
  {
    const int64_t p = only[n], count = pointer[p + 1] - pointer[p];
    double normal[MOST][MOST] = {{0.0}};
    int k = 0;
    for (int64_t a = 0; a < count; ++a)
    {
      const double *x = points + 2 * (int64_t)nodes[pointer[p] + a];
      double *row = basis + MOST * a;
      memset(row, 0, sizeof(double) * MOST);
      k = monomials((x[0] - centres[2 * p]) / scales[2 * p], (x[1] - centres[2 * p + 1]) / scales[2 * p + 1], degree,
                    parity, row);
      for (int i = 0; i < k; ++i)
        for (int j = 0; j < MOST; ++j) /* a fixed number is vectorised */
          normal[i][j] += row[i] * row[j];
    }
    double trace = 0.0;
    for (int i = 0; i < k; ++i)
      trace += normal[i][i];
    /* Cholesky */
    for (int i = 0; i < k; ++i)
    {
      normal[i][i] += ridge * trace / k;
      for (int j = 0; j <= i; ++j)
      {
        double sum = normal[i][j];
        for (int l = 0; l < j; ++l)
          sum -= normal[i][l] * normal[j][l];
        if (i > j)
          normal[i][j] = sum / normal[j][j];
        else if (sum > 0)
          normal[i][i] = sqrt(sum);
        else
          status = 2;
      }
    }
    /* Inverse of the normal equations, column by column. */
    double inverse[MOST][MOST] = {{0.0}};
    for (int c = 0; c < k && !status; ++c)
    {
      double *column = inverse[c];
      for (int i = c; i < k; ++i)
      {
        double sum = i == c ? 1.0 : 0.0;
        for (int l = c; l < i; ++l)
          sum -= normal[i][l] * column[l];
        column[i] = sum / normal[i][i];
      }
      for (int i = k - 1; i >= 0; --i)
      {
        double sum = column[i];
        for (int l = i + 1; l < k; ++l)
          sum -= normal[l][i] * column[l];
        column[i] = sum / normal[i][i];
      }
    }
    for (int64_t a = 0; a < count; ++a)
    {
      const double *row = basis + MOST * a;
      double coefficient[MOST] = {0.0};
      for (int j = 0; j < k; ++j)
        for (int i = 0; i < MOST; ++i) /* a fixed number is vectorised */
          coefficient[i] += row[j] * inverse[j][i];
      for (int i = 0; i < k; ++i)
      {
        fits[pointer[p] * k + i * count + a] = coefficient[i];
        columns[pointer[p] * k + i * count + a] = nodes[pointer[p] + a];
      }
    }
  }
  free(basis);
  return status;
}

/* Nodes of the patch around every vertex: those that the cells there carry, and as long as they are fewer than wanted
   those of the next ring of cells. around: cells at each vertex, by a pointer. carried: nodes in the first entries of
   each cell that count. vertex: number of a point among the vertices. cell_marker, node_marker: work space of one entry
   a cell and one a point, -1 at first; work: of one entry a cell. Returns the number of nodes, or -1 if there are more
   than `most`. */
int64_t patch_nodes(int64_t vertices, const int64_t *around_ptr, const int64_t *around, const int64_t *vertex,
                    const int64_t *cells, int32_t per_cell, int32_t carried, int64_t fewest, int64_t *cell_marker,
                    int64_t *node_marker, int64_t *work, int64_t most, int64_t *pointer, int32_t *nodes)
{
  int64_t total = 0;
  for (int64_t v = 0; v < vertices; ++v)
  {
    int64_t ring = 0, members = 0, count = 0;
    pointer[v] = total;
    for (int64_t k = around_ptr[v]; k < around_ptr[v + 1]; ++k)
    {
      cell_marker[around[k]] = v;
      work[members++] = around[k];
    }
    do
    {
      const int64_t end = members;
      for (int64_t m = ring; m < end; ++m)
        for (int32_t a = 0; a < carried; ++a)
        {
          const int64_t node = cells[work[m] * per_cell + a];
          if (node_marker[node] == v)
            continue;
          if (total + count == most)
            return -1;
          node_marker[node] = v;
          nodes[total + count++] = (int32_t)node;
        }
      if (count >= fewest)
        break;
      for (int64_t m = ring; m < end; ++m)
        for (int32_t a = 0; a < 3; ++a)
        {
          const int64_t other = vertex[cells[work[m] * per_cell + a]];
          for (int64_t k = around_ptr[other]; k < around_ptr[other + 1]; ++k)
            if (cell_marker[around[k]] != v)
            {
              cell_marker[around[k]] = v;
              work[members++] = around[k];
            }
        }
      ring = end;
    } while (ring < members);
    total += count;
  }
  pointer[vertices] = total;
  return total;
}
