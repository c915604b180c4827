/* Location of points in a mesh of triangles, by a grid of rectangles over their bounding boxes. */

#include <math.h>
#include <stdint.h>
#include <stdlib.h>

typedef struct
{
  double low[2], width[2];
  int64_t count[2];
} grid;

static int64_t clamped(double x, int64_t count)
{
  return x < 0 ? 0 : x >= (double)count ? count - 1 : (int64_t)x;
}

/* First and last rectangle along both axes that the bounding box of a triangle touches. */
static void span(const grid *g, const double *points, const int32_t *corners, int64_t first[2], int64_t last[2])
{
  for (int k = 0; k < 2; ++k)
  {
    const double a = points[2 * corners[0] + k], b = points[2 * corners[1] + k], c = points[2 * corners[2] + k];
    first[k] = clamped((fmin(a, fmin(b, c)) - g->low[k]) / g->width[k], g->count[k]);
    last[k] = clamped((fmax(a, fmax(b, c)) - g->low[k]) / g->width[k], g->count[k]);
  }
}

static int contains(const double *points, const int32_t *corners, const double *place, double tolerance)
{
  const double *a = points + 2 * corners[0], *b = points + 2 * corners[1], *c = points + 2 * corners[2];
  const double u[2] = {b[0] - a[0], b[1] - a[1]}, v[2] = {c[0] - a[0], c[1] - a[1]};
  const double w[2] = {place[0] - a[0], place[1] - a[1]}, det = u[0] * v[1] - u[1] * v[0];
  const double s = (w[0] * v[1] - w[1] * v[0]) / det, t = (u[0] * w[1] - u[1] * w[0]) / det;
  return s >= -tolerance && t >= -tolerance && s + t <= 1 + tolerance;
}

/* The first triangle that contains each place, -1 where there is none. Returns 0, or 1 without memory. */
int find_triangles(int64_t triangles, const int32_t *corners, int64_t nodes, const double *points, int64_t places,
                   const double *place, double tolerance, int32_t *found)
{
  grid g;
  double high[2];
  for (int k = 0; k < 2; ++k)
  {
    g.low[k] = high[k] = points[k];
    for (int64_t n = 1; n < nodes; ++n)
    {
      g.low[k] = fmin(g.low[k], points[2 * n + k]);
      high[k] = fmax(high[k], points[2 * n + k]);
    }
  }
  const double side = sqrt((high[0] - g.low[0]) * (high[1] - g.low[1]) / (double)triangles);
  for (int k = 0; k < 2; ++k)
  {
    g.count[k] = 1 + (int64_t)((high[k] - g.low[k]) / side);
    g.width[k] = (high[k] - g.low[k]) / (double)g.count[k];
  }
  int64_t *start = calloc((size_t)(g.count[0] * g.count[1] + 1), sizeof(int64_t)), first[2], last[2];
  int32_t *inside = NULL;
  if (!start)
    return 1;
  /* Triangles by rectangle, in compressed form: counted first, then filled in from the last to the first. */
  for (int fill = 0; fill < 2; ++fill)
  {
    for (int64_t t = triangles - 1; t >= 0; --t)
    {
      span(&g, points, corners + 3 * t, first, last);
      for (int64_t i = first[0]; i <= last[0]; ++i)
        for (int64_t j = first[1]; j <= last[1]; ++j)
        {
          int64_t *at = start + i * g.count[1] + j;
          if (fill)
            inside[--*at] = (int32_t)t;
          else
            ++*at;
        }
    }
    if (fill)
      break;
    for (int64_t r = 1; r <= g.count[0] * g.count[1]; ++r)
      start[r] += start[r - 1];
    inside = malloc(sizeof(int32_t) * (size_t)start[g.count[0] * g.count[1]]);
    if (!inside)
    {
      free(start);
      return 1;
    }
  }
  for (int64_t p = 0; p < places; ++p)
  {
    const int64_t i = clamped((place[2 * p] - g.low[0]) / g.width[0], g.count[0]);
    const int64_t j = clamped((place[2 * p + 1] - g.low[1]) / g.width[1], g.count[1]);
    const int64_t at = i * g.count[1] + j;
    found[p] = -1;
    for (int64_t q = start[at]; q < start[at + 1] && found[p] < 0; ++q)
      if (contains(points, corners + 3 * inside[q], place + 2 * p, tolerance))
        found[p] = inside[q];
  }
  free(start);
  free(inside);
  return 0;
}
