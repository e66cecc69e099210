/* The only file that knows Embree 3 from Embree 4. */
#include "embree.h"

#ifdef __SSE__
#include <xmmintrin.h>
#endif

/* Small enough to vanish into its callers; they are compiled with -O3. */
static inline void set_ray(struct RTCRay *r, const mlx_ray *ray) {
  r->org_x = ray->o[0];
  r->org_y = ray->o[1];
  r->org_z = ray->o[2];
  r->tnear = 0.0f;
  r->dir_x = ray->d[0];
  r->dir_y = ray->d[1];
  r->dir_z = ray->d[2];
  r->time = 0.0f;
  r->tfar = ray->t_max;
  r->mask = 0xffffffffu;
  r->id = 0;
  r->flags = 0;
}

/* The number of a primitive that is no triangle of the world. */
static __attribute__((noinline, cold)) uint64_t number(const mlx_split *split, const struct RTCHit *hit) {
  const uint32_t instance = hit->instID[0] - MLX_INSTANCES;
  switch (hit->geomID) {
  case RTC_INVALID_GEOMETRY_ID:
    return MLX_MISS;
  case MLX_QUADRICS:
    return split->world + hit->primID;
  case MLX_OBJECT_TRIANGLES:
    return ((uint64_t)instance + 1) << 32 | hit->primID;
  default:
    return ((uint64_t)instance + 1) << 32 | (split->objects[instance] + hit->primID);
  }
}

static inline uint64_t nearest(RTCScene scene, const mlx_split *split, const mlx_ray *ray) {
  struct RTCRayHit q;
  set_ray(&q.ray, ray);
  q.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  q.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
#if MLX_EMBREE >= 4
  rtcIntersect1(scene, &q, NULL);
#else
  struct RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(scene, &context, &q);
#endif
  return q.hit.geomID == MLX_TRIANGLES ? q.hit.primID : number(split, &q.hit);
}

static inline bool occluded(RTCScene scene, const mlx_ray *ray) {
  struct RTCRay r;
  set_ray(&r, ray);
#if MLX_EMBREE >= 4
  rtcOccluded1(scene, &r, NULL);
#else
  struct RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(scene, &context, &r);
#endif
  /* Embree says "occluded" by tfar = -inf. */
  return r.tfar < 0.0f;
}

uint64_t mlx_nearest(RTCScene scene, const mlx_split *split, const mlx_ray *ray) { return nearest(scene, split, ray); }

bool mlx_occluded(RTCScene scene, const mlx_ray *ray) { return occluded(scene, ray); }

uint64_t mlx_replay(RTCScene scene, const mlx_split *split, const mlx_ray *rays, const uint8_t *kinds, size_t count, bool flush) {
  uint64_t sum = 0;
#ifdef __SSE__
  const unsigned mode = _mm_getcsr();
  /* Flush to zero, denormals are zero. */
  if (flush)
    _mm_setcsr(mode | 0x8040);
#endif
  for (size_t i = 0; i < count; i++)
    sum += kinds[i] ? (uint64_t)occluded(scene, &rays[i]) : nearest(scene, split, &rays[i]);
#ifdef __SSE__
  _mm_setcsr(mode);
#endif
  (void)flush;
  return sum;
}

/* Only single-ray queries are made, so the callbacks see N = 1, where the packet layout is that of RTCRayHit. */

static void user_bounds(const struct RTCBoundsFunctionArguments *args) {
  const mlx_user *user = (const mlx_user *)args->geometryUserPtr;
  float box[6];
  user->bounds(user->data, args->primID, box);
  args->bounds_o->lower_x = box[0];
  args->bounds_o->lower_y = box[1];
  args->bounds_o->lower_z = box[2];
  args->bounds_o->upper_x = box[3];
  args->bounds_o->upper_y = box[4];
  args->bounds_o->upper_z = box[5];
}

static inline float user_hit(const mlx_user *user, uint32_t prim, const struct RTCRay *r) {
  const mlx_ray ray = {{r->org_x, r->org_y, r->org_z}, {r->dir_x, r->dir_y, r->dir_z}, r->tfar};
  return user->hit(user->data, prim, &ray);
}

static void user_intersect(const struct RTCIntersectFunctionNArguments *args) {
  struct RTCRayHit *q = (struct RTCRayHit *)args->rayhit;
  if (args->N != 1 || !args->valid[0])
    return;
  const float t = user_hit((const mlx_user *)args->geometryUserPtr, args->primID, &q->ray);
  if (t > 0.0f) {
    q->ray.tfar = t;
    q->hit.primID = args->primID;
    q->hit.geomID = args->geomID;
    q->hit.instID[0] = args->context->instID[0];
  }
}

static void user_occluded(const struct RTCOccludedFunctionNArguments *args) {
  struct RTCRay *r = (struct RTCRay *)args->ray;
  if (args->N != 1 || !args->valid[0])
    return;
  if (user_hit((const mlx_user *)args->geometryUserPtr, args->primID, r) > 0.0f)
    r->tfar = -__builtin_inff();
}

void mlx_set_user(RTCGeometry geometry, struct mlx_user *user, uint32_t count) {
  rtcSetGeometryUserPrimitiveCount(geometry, count);
  rtcSetGeometryUserData(geometry, user);
  rtcSetGeometryBoundsFunction(geometry, user_bounds, NULL);
  rtcSetGeometryIntersectFunction(geometry, user_intersect);
  rtcSetGeometryOccludedFunction(geometry, user_occluded);
}

void mlx_set_instance(RTCGeometry geometry, RTCScene object, const float map[12]) {
  rtcSetGeometryInstancedScene(geometry, object);
  rtcSetGeometryTransform(geometry, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, map);
}
