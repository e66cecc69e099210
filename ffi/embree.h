/* The one meeting point with Embree.
 *
 * Embree 3 and 4 share names and differ in a few signatures; embree.c hides those. Struct layouts come from the header
 * of the installed library, never from a copy: a library built with another configuration than the header's writes
 * outside the caller's structs.
 */
#ifndef MLX_EMBREE_H
#define MLX_EMBREE_H

#if defined(__has_include)
#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#define MLX_EMBREE 4
#elif __has_include(<embree3/rtcore.h>)
#include <embree3/rtcore.h>
#define MLX_EMBREE 3
#endif
#endif
#ifndef MLX_EMBREE
#error "No Embree header: neither embree4/rtcore.h nor embree3/rtcore.h is on the include path."
#endif

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Version of the header this was built against, as RTC_VERSION writes it. */
enum { MLX_HEADER_VERSION = RTC_VERSION };

/* "Nothing was hit." */
static const uint64_t MLX_MISS = UINT64_MAX;

/* Which geometry of a scene is what: by these numbers, in the world and in the scene of an object. */
enum {
  MLX_TRIANGLES = 0,
  MLX_QUADRICS = 1,
  MLX_OBJECT_TRIANGLES = 2,
  MLX_OBJECT_QUADRICS = 3,
  /* Instance i of the world is geometry MLX_INSTANCES + i. */
  MLX_INSTANCES = 2,
};

/* Flag of a scene whose queries may leave out triangles. */
#if MLX_EMBREE >= 4
enum { MLX_FILTERED = RTC_SCENE_FLAG_FILTER_FUNCTION_IN_ARGUMENTS };
#else
enum { MLX_FILTERED = RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION };
#endif

/* A ray o + t d, 0 < t < t_max. */
typedef struct mlx_ray {
  float o[3];
  float d[3];
  float t_max;
} mlx_ray;

/* What a geometry of curved primitives is made of; its user data points here. */
typedef struct mlx_user {
  const void *data;
  /* Box around a primitive: lower x y z, upper x y z. */
  void (*bounds)(const void *data, uint32_t prim, float box[6]);
  /* Distance of the nearest hit in 0 < t < t_max, or a negative number. */
  float (*hit)(const void *data, uint32_t prim, const mlx_ray *ray);
} mlx_user;

/* Makes `geometry` (RTC_GEOMETRY_TYPE_USER) answer through `user`, which must outlive it. */
void mlx_set_user(RTCGeometry geometry, struct mlx_user *user, uint32_t count);

/* Who hears what a device complains of, and by how many bytes its memory changes. */
typedef struct mlx_ears {
  const void *data;
  void (*error)(const void *data, uint32_t code, const char *text);
  void (*memory)(const void *data, int64_t bytes);
} mlx_ears;

/* Lets `ears`, which must outlive it, hear of the device. */
void mlx_listen(RTCDevice device, struct mlx_ears *ears);

/* Who hears, from any thread, which part of a build is done. */
typedef struct mlx_teller {
  const void *data;
  void (*tell)(const void *data, double done);
} mlx_teller;

/* Builds a scene; `teller` is forgotten when it is done. */
void mlx_commit(RTCScene scene, struct mlx_teller *teller);

/* How primitives are numbered: triangles first, then quadrics. */
typedef struct mlx_split {
  /* Triangles of the world. */
  uint32_t world;
  /* For each instance, the triangles of its object; may be null if no object has quadrics. */
  const uint32_t *objects;
} mlx_split;

/* Nearest primitive, or MLX_MISS: its number, for one of instance i with i + 1 in the upper half. */
uint64_t mlx_nearest(RTCScene scene, const mlx_split *split, const mlx_ray *ray);

/* Makes `geometry` (RTC_GEOMETRY_TYPE_INSTANCE) the committed scene `object` under the affine map given by columns. */
void mlx_set_instance(RTCGeometry geometry, RTCScene object, const float map[12]);

/* Is there anything in 0 < t < t_max? */
bool mlx_occluded(RTCScene scene, const mlx_ray *ray);

/* The same two without two triangles, given by their numbers (those of quadrics leave out nothing), for scenes that have
 * the flag MLX_FILTERED. */
uint64_t mlx_nearest_but(RTCScene scene, const mlx_split *split, const mlx_ray *ray, const uint64_t but[2]);
bool mlx_occluded_but(RTCScene scene, const mlx_ray *ray, const uint64_t but[2]);

/* The bare loops that a benchmark compares with: one query a ray, kinds[i] 0 = nearest, 1 = occluded.
 * Returns the sum of the answers (primitive number, MLX_MISS, 0 or 1).
 * flush: denormal numbers count as 0, as in the queries above, but the mode is set once for all rays. */
uint64_t mlx_replay(RTCScene scene, const mlx_split *split, const mlx_ray *rays, const uint8_t *kinds, size_t count, bool flush);

#endif
