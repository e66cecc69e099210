/* The only file that knows Embree 3 from Embree 4. */
#include "embree.h"

#ifdef __SSE__
#include <xmmintrin.h>
#endif

/* Embree's makers advise that denormal numbers count as 0 wherever it traces; its own builds do so. Rust takes the default
 * mode for granted: so the one is on around every query and off whenever Rust is called back. */
#ifdef __SSE__
#define DEFAULT_MODE 0x1f80u
/* Flush to zero, denormals are zero. */
#define FLUSH_MODE (DEFAULT_MODE | 0x8040u)
static inline unsigned get_mode(void) { return _mm_getcsr(); }
static inline void set_mode(unsigned mode) { _mm_setcsr(mode); }
#else
#define DEFAULT_MODE 0u
#define FLUSH_MODE 0u
static inline unsigned get_mode(void) { return DEFAULT_MODE; }
static inline void set_mode(unsigned mode) { (void)mode; }
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

static inline uint64_t named(const mlx_split *split, const struct RTCHit *hit) {
  return hit->geomID == MLX_TRIANGLES ? hit->primID : number(split, hit);
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
  return named(split, &q.hit);
}

/* Embree says "occluded" by tfar = -inf. */
static inline bool is_occluded(const struct RTCRay *r) { return r->tfar < 0.0f; }

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
  return is_occluded(&r);
}

uint64_t mlx_nearest(RTCScene scene, const mlx_split *split, const mlx_ray *ray) {
  set_mode(FLUSH_MODE);
  const uint64_t prim = nearest(scene, split, ray);
  set_mode(DEFAULT_MODE);
  return prim;
}

bool mlx_occluded(RTCScene scene, const mlx_ray *ray) {
  set_mode(FLUSH_MODE);
  const bool hit = occluded(scene, ray);
  set_mode(DEFAULT_MODE);
  return hit;
}

uint64_t mlx_replay(RTCScene scene, const mlx_split *split, const mlx_ray *rays, const uint8_t *kinds, size_t count, bool flush) {
  uint64_t sum = 0;
  set_mode(flush ? FLUSH_MODE : DEFAULT_MODE);
  for (size_t i = 0; i < count; i++)
    sum += kinds[i] ? (uint64_t)occluded(scene, &rays[i]) : nearest(scene, split, &rays[i]);
  set_mode(DEFAULT_MODE);
  return sum;
}

/* A query that leaves out triangles: its context with what the filter is to know. */
#if MLX_EMBREE >= 4
typedef struct RTCRayQueryContext context_base;
#else
typedef struct RTCIntersectContext context_base;
#endif
typedef struct context {
  context_base base;
  uint64_t but[2];
} context;

/* Embree asks it for triangles alone: user geometry would have to call it itself. */
static void filter(const struct RTCFilterFunctionNArguments *args) {
  const context *c = (const context *)args->context;
  const struct RTCHit *hit = (const struct RTCHit *)args->hit;
  if (args->N != 1)
    return;
  const uint64_t place = hit->geomID == MLX_TRIANGLES ? 0 : (uint64_t)(hit->instID[0] - MLX_INSTANCES) + 1;
  const uint64_t id = place << 32 | hit->primID;
  if (id == c->but[0] || id == c->but[1])
    args->valid[0] = 0;
}

static inline void begin(context *c, const uint64_t but[2]) {
#if MLX_EMBREE >= 4
  rtcInitRayQueryContext(&c->base);
#else
  rtcInitIntersectContext(&c->base);
  c->base.filter = filter;
#endif
  c->but[0] = but[0];
  c->but[1] = but[1];
}

uint64_t mlx_nearest_but(RTCScene scene, const mlx_split *split, const mlx_ray *ray, const uint64_t but[2]) {
  struct RTCRayHit q;
  set_ray(&q.ray, ray);
  q.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  q.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  context c;
  begin(&c, but);
  set_mode(FLUSH_MODE);
#if MLX_EMBREE >= 4
  struct RTCIntersectArguments args;
  rtcInitIntersectArguments(&args);
  args.flags |= RTC_RAY_QUERY_FLAG_INVOKE_ARGUMENT_FILTER;
  args.context = &c.base;
  args.filter = filter;
  rtcIntersect1(scene, &q, &args);
#else
  rtcIntersect1(scene, &c.base, &q);
#endif
  set_mode(DEFAULT_MODE);
  return named(split, &q.hit);
}

bool mlx_occluded_but(RTCScene scene, const mlx_ray *ray, const uint64_t but[2]) {
  struct RTCRay r;
  set_ray(&r, ray);
  context c;
  begin(&c, but);
  set_mode(FLUSH_MODE);
#if MLX_EMBREE >= 4
  struct RTCOccludedArguments args;
  rtcInitOccludedArguments(&args);
  args.flags |= RTC_RAY_QUERY_FLAG_INVOKE_ARGUMENT_FILTER;
  args.context = &c.base;
  args.filter = filter;
  rtcOccluded1(scene, &r, &args);
#else
  rtcOccluded1(scene, &c.base, &r);
#endif
  set_mode(DEFAULT_MODE);
  return is_occluded(&r);
}

/* What Rust hears of the library while it works. */

static void on_error(void *ears, enum RTCError code, const char *text) {
  const mlx_ears *e = (const mlx_ears *)ears;
  const unsigned mode = get_mode();
  set_mode(DEFAULT_MODE);
  e->error(e->data, (uint32_t)code, text);
  set_mode(mode);
}

static bool on_memory(void *ears, ssize_t bytes, bool post) {
  const mlx_ears *e = (const mlx_ears *)ears;
  const unsigned mode = get_mode();
  (void)post;
  set_mode(DEFAULT_MODE);
  e->memory(e->data, bytes);
  set_mode(mode);
  return true;
}

static bool on_progress(void *teller, double done) {
  const mlx_teller *t = (const mlx_teller *)teller;
  const unsigned mode = get_mode();
  set_mode(DEFAULT_MODE);
  t->tell(t->data, done);
  set_mode(mode);
  return true;
}

void mlx_listen(RTCDevice device, struct mlx_ears *ears) {
  rtcSetDeviceErrorFunction(device, on_error, ears);
  rtcSetDeviceMemoryMonitorFunction(device, on_memory, ears);
}

void mlx_commit(RTCScene scene, struct mlx_teller *teller) {
  rtcSetSceneProgressMonitorFunction(scene, on_progress, teller);
  rtcCommitScene(scene);
  rtcSetSceneProgressMonitorFunction(scene, NULL, NULL);
}

/* Only single-ray queries are made, so the callbacks see N = 1, where the packet layout is that of RTCRayHit. */

static void user_bounds(const struct RTCBoundsFunctionArguments *args) {
  const mlx_user *user = (const mlx_user *)args->geometryUserPtr;
  float box[6];
  const unsigned mode = get_mode();
  set_mode(DEFAULT_MODE);
  user->bounds(user->data, args->primID, box);
  set_mode(mode);
  args->bounds_o->lower_x = box[0];
  args->bounds_o->lower_y = box[1];
  args->bounds_o->lower_z = box[2];
  args->bounds_o->upper_x = box[3];
  args->bounds_o->upper_y = box[4];
  args->bounds_o->upper_z = box[5];
}

static inline float user_hit(const mlx_user *user, uint32_t prim, const struct RTCRay *r) {
  const mlx_ray ray = {{r->org_x, r->org_y, r->org_z}, {r->dir_x, r->dir_y, r->dir_z}, r->tfar};
  const unsigned mode = get_mode();
  set_mode(DEFAULT_MODE);
  const float t = user->hit(user->data, prim, &ray);
  set_mode(mode);
  return t;
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
