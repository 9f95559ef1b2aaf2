// GLSL of the renderer (OpenGL 3.3). Colours are display values; light is simple on purpose: this is no path tracer.
// `//// NAME` begins a part; `#include NAME` puts another in.

//// LIGHT
uniform vec3 u_cam;          // place of the camera
uniform vec3 u_sun;          // towards the sun or the moon
uniform vec3 u_sun_light;
uniform vec3 u_sky_light;    // from above
uniform vec3 u_ground_light; // from below
uniform vec3 u_air;          // what the air scatters towards the camera
uniform float u_extinction;  // 1/m
uniform float u_night;
uniform float u_wet;
uniform float u_snow;
uniform vec4 u_ego;          // front bumper x, y; heading cos, sin
uniform float u_head;        // head lamps of the ego
uniform vec3 u_grade;        // exposure, contrast, saturation
uniform vec3 u_tint;
uniform vec4 u_lens;         // vignette, width, height, unused
uniform mat4 u_shadow_matrix;
uniform float u_shadows;
uniform sampler2DShadow u_shadow_map;
uniform sampler2D u_noise;

#ifdef SHADOWS
float sunlit(vec3 p) {
    vec3 q = (u_shadow_matrix * vec4(p, 1.0)).xyz;
    vec2 rim = abs(q.xy - 0.5);
    float outside = step(0.5, max(rim.x, rim.y));
    float lit = texture(u_shadow_map, vec3(q.xy, q.z - 0.0016));
    return mix(1.0, max(lit, outside), u_shadows);
}
#else
float sunlit(vec3 p) { return 1.0; }
#endif

vec3 light_at(vec3 p, vec3 n, float sun) {
    vec3 light = mix(u_ground_light, u_sky_light, 0.5 + 0.5 * n.z) + u_sun_light * (max(dot(n, u_sun), 0.0) * sun);
#ifdef HEAD
    vec2 d = p.xy - u_ego.xy;
    float far = length(d) + 0.01;
    float ahead = dot(d, u_ego.zw) / far;
    float beam = smoothstep(0.80, 0.985, ahead) * exp(-far / 26.0) * (1.0 - 0.75 * smoothstep(0.9, 2.6, p.z));
    light += vec3(1.0, 0.95, 0.82) * (u_head * 1.25 * beam);
#endif
    return light;
}

vec3 finish(vec3 c, vec3 p) {
    float d = length(p - u_cam);
    c = mix(u_air, c, exp(-u_extinction * d));
    return c;
}

vec4 graded(vec3 c) {
    vec2 r = gl_FragCoord.xy / u_lens.yz - 0.5;
    c *= u_tint * (u_grade.x * (1.0 - u_lens.x * 1.6 * dot(r, r)));
    c = (c - 0.5) * u_grade.y + 0.5;
    c = mix(vec3(dot(c, vec3(0.30, 0.59, 0.11))), c, u_grade.z);
    return vec4(clamp(c, 0.0, 1.0), 1.0);
}

//// SOLID_VERTEX
#version 330
uniform mat4 u_clip;
in vec3 in_place;
in vec3 in_normal;
in vec4 i_turn;    // cosine and sine of yaw and of pitch
in vec3 i_at;
in vec3 i_size;
in vec3 i_colour;
in vec4 i_form;    // taper x, taper y, shift, material
in vec3 i_mark;    // glow, instance, class
#ifdef LIT
out vec3 v_place;
out vec3 v_normal;
out vec3 v_local;
flat out vec3 v_face;
flat out vec3 v_colour;
flat out vec2 v_kind;
flat out vec3 v_size;
#endif
#ifdef TRUTH
flat out vec3 v_label;
out float v_depth;
#endif
void main() {
    float top = in_place.z + 0.5;
    vec3 size = i_size;
    vec3 q = in_place;
    q.xy *= mix(vec2(1.0), i_form.xy, top);
    q.x += i_form.z * top;
    q *= size;
    float cy = i_turn.x, sy = i_turn.y, cp = i_turn.z, sp = i_turn.w;
    vec3 r = vec3(cp * q.x + sp * q.z, q.y, cp * q.z - sp * q.x);
    vec3 p = vec3(cy * r.x - sy * r.y, sy * r.x + cy * r.y, r.z) + i_at;
    gl_Position = u_clip * vec4(p, 1.0);
#ifdef LIT
    vec3 n = in_normal / size;
    n.z += dot(abs(in_normal.xy), (1.0 - i_form.xy) * 0.5) / size.z * (1.0 - abs(in_normal.z));
    n = normalize(n);
    vec3 m = vec3(cp * n.x + sp * n.z, n.y, cp * n.z - sp * n.x);
    v_normal = vec3(cy * m.x - sy * m.y, sy * m.x + cy * m.y, m.z);
    v_place = p;
    v_local = in_place;
    v_face = in_normal;
    v_colour = i_colour;
    v_kind = vec2(i_form.w, i_mark.x);
    v_size = size;
#endif
#ifdef TRUTH
    v_label = vec3(mod(i_mark.y, 256.0), floor(i_mark.y / 256.0), i_mark.z) / 255.0;
    v_depth = gl_Position.w;
#endif
}

//// SOLID_HEAD
#version 330
#include LIGHT

in vec3 v_place;
in vec3 v_normal;
in vec3 v_local;
flat in vec3 v_face;
flat in vec3 v_colour;
flat in vec2 v_kind;
flat in vec3 v_size;
out vec4 out_colour;
vec3 snowed(vec3 c, vec3 n) {
    return mix(c, vec3(0.93, 0.95, 0.98), smoothstep(0.35, 0.75, n.z) * min(1.0, u_snow * 1.5));
}

//// PLAIN_FRAGMENT
#include SOLID_HEAD

void main() {
    vec3 n = normalize(v_normal);
    float glass = float(v_kind.x > 2.5 && v_kind.x < 3.5);
    float lamp = float(v_kind.x > 3.5 && v_kind.x < 4.5);
    float stripes = float(v_kind.x > 4.5);
    vec3 c = v_colour;
    float band = step(0.5, fract((v_local.z * v_size.z + v_local.y * v_size.y * (1.0 - lamp)) * 2.2));
    c = mix(c, mix(c, vec3(0.95), band), stripes);
    c = snowed(c, n * (1.0 - lamp));
    vec3 light = light_at(v_place, n, sunlit(v_place));
    vec3 to = normalize(u_cam - v_place);
    float rim = 1.0 - max(dot(n, to), 0.0);
    vec3 mirrored = u_sky_light * (0.55 + 0.45 * n.z);
    vec3 lit = c * light + mirrored * (0.04 + 0.16 * rim * rim * rim) * (1.0 - 0.5 * u_snow);
    lit = mix(lit, c * light + mirrored * (0.22 + 0.5 * max(n.z, 0.0)), glass);
    float glow = v_kind.y < 0.0 ? -v_kind.y * u_night : v_kind.y;
    vec3 own = mix(v_colour * 1.5, vec3(1.0), 0.18) * glow;
    lit = mix(lit, max(c * light, own), lamp);
    vec3 fogged = finish(lit, v_place);
    fogged = max(fogged, own * lamp * exp(-0.45 * u_extinction * length(v_place - u_cam)));
    out_colour = graded(fogged);
}

//// FACADE_FRAGMENT
#include SOLID_HEAD

float hash(vec3 p) { return fract(sin(dot(p, vec3(12.9898, 78.233, 37.719))) * 43758.5453); }
void main() {
    vec3 n = normalize(v_normal);
    float side = step(0.5, abs(v_face.x)), wall = 1.0 - step(0.5, abs(v_face.z));
    float u = mix(v_local.x * v_size.x, v_local.y * v_size.y, side);
    float z = (v_local.z + 0.5) * v_size.z;
    vec2 cell = vec2(u / 2.7 + 0.5, z / 3.3);
    vec2 f = fract(cell), w = fwidth(cell) + 1e-4;
    vec2 low = vec2(0.24, 0.30), high = vec2(0.76, 0.80);
    float ground_floor = step(cell.y, 1.0);
    low.y = mix(low.y, 0.12, ground_floor);
    vec2 inside = clamp((f - low) / w + 0.5, 0.0, 1.0) * clamp((high - f) / w + 0.5, 0.0, 1.0);
    float pane = inside.x * inside.y;
    pane = mix(pane, 0.26, smoothstep(0.35, 0.9, max(w.x, w.y))) * wall * step(z, v_size.z - 0.7);
    vec3 id = vec3(floor(cell), v_kind.y * 71.0 + dot(v_face.xy, vec2(3.0, 7.0)));
    float draw = hash(id);
    float texture_ = texture(u_noise, vec2(u, z) * 0.11).r;
    vec3 c = v_colour * (0.90 + 0.20 * texture_);
    c *= 1.0 - 0.22 * smoothstep(0.985, 1.0, f.y) * wall;
    c = snowed(c, n);
    vec3 light = light_at(v_place, n, sunlit(v_place));
    vec3 glass = vec3(0.12, 0.15, 0.18) * light + u_sky_light * (0.10 + 0.30 * draw);
    vec3 lit = mix(c * light, glass, pane);
    float on = step(0.58, draw) * pane * smoothstep(0.25, 0.8, u_night);
    lit = mix(lit, vec3(1.0, 0.80, 0.48) * (0.55 + 0.45 * fract(draw * 17.0)), on * 0.9);
    out_colour = graded(finish(lit, v_place));
}

//// FOLIAGE_FRAGMENT
#include SOLID_HEAD

void main() {
    vec3 n = normalize(v_normal);
    vec3 q = v_place * 0.35;
    float leaf = texture(u_noise, vec2(q.x + q.z * 0.7, q.y - q.z * 0.9)).r;
    float fine = texture(u_noise, vec2(q.x - q.z, q.y + q.z) * 3.1).r;
    vec3 c = v_colour * (0.45 + 0.75 * leaf + 0.4 * (fine - 0.5));
    n = normalize(n + vec3(leaf - 0.5, fine - 0.5, 0.25 * (leaf + fine) - 0.25) * 1.1);
    float laden = min(1.0, 0.35 * step(0.01, u_snow) + u_snow);
    c = mix(c, vec3(0.92, 0.94, 0.97), smoothstep(0.0, 0.6, n.z + 0.5 * (fine - 0.5)) * laden);
    vec3 light = light_at(v_place, n, sunlit(v_place + n * 0.3));
    out_colour = graded(finish(c * light, v_place));
}

//// SIGN_FRAGMENT
#include SOLID_HEAD

float bar(vec2 p, vec2 a, vec2 b) {
    vec2 d = b - a;
    float t = clamp(dot(p - a, d) / dot(d, d), 0.0, 1.0);
    return step(length(p - a - t * d), 0.15);
}
float glyph(int mask, vec2 p) {  // seven segments and a middle upright, p in -1..1
    float f = 0.0;
    if ((mask & 1) != 0) f = max(f, bar(p, vec2(-0.6, 0.85), vec2(0.6, 0.85)));
    if ((mask & 2) != 0) f = max(f, bar(p, vec2(0.6, 0.85), vec2(0.6, 0.0)));
    if ((mask & 4) != 0) f = max(f, bar(p, vec2(0.6, 0.0), vec2(0.6, -0.85)));
    if ((mask & 8) != 0) f = max(f, bar(p, vec2(-0.6, -0.85), vec2(0.6, -0.85)));
    if ((mask & 16) != 0) f = max(f, bar(p, vec2(-0.6, 0.0), vec2(-0.6, -0.85)));
    if ((mask & 32) != 0) f = max(f, bar(p, vec2(-0.6, 0.85), vec2(-0.6, 0.0)));
    if ((mask & 64) != 0) f = max(f, bar(p, vec2(-0.6, 0.0), vec2(0.6, 0.0)));
    if ((mask & 128) != 0) f = max(f, bar(p, vec2(0.0, 0.85), vec2(0.0, -0.85)));
    return f;
}
int digit(int d) {
    int masks[10] = int[10](63, 6, 91, 79, 102, 109, 125, 7, 127, 111);
    return masks[d];
}
void main() {
    vec2 p = vec2(-v_local.y, v_local.z) * 2.0;
    float kind = floor(v_colour.r * 8.0 + 0.5);
    float shape, rim;
    vec3 face, border;
    float ink = 0.0;
    vec3 ink_colour = vec3(1.0);
    if (kind < 1.5) {
        shape = max(max(abs(p.x), abs(p.y)) - 0.98, (abs(p.x) + abs(p.y)) * 0.7071 - 0.98);
        rim = -0.10; face = vec3(0.72, 0.05, 0.06); border = vec3(0.95);
        float slot = (p.x + 0.76) / 0.38;
        int at = int(floor(slot));
        vec2 q = vec2((fract(slot) - 0.5) * 2.4, p.y / 0.34);
        int mask = at == 0 ? 109 : at == 1 ? 129 : at == 2 ? 63 : at == 3 ? 115 : 0;
        ink = glyph(mask, q);
    } else if (kind < 2.5) {
        shape = max(p.y - 0.95, abs(p.x) * 0.87 - 0.5 * p.y - 0.47);
        rim = -0.22; face = vec3(0.95); border = vec3(0.78, 0.06, 0.07);
    } else {
        p.y *= v_size.z / v_size.y;
        shape = length(p) - 0.98;
        rim = -0.22; face = vec3(0.96); border = vec3(0.78, 0.06, 0.07);
        int number = int(v_colour.g * 128.0 + 0.5);
        ink_colour = vec3(0.06);
        float count = number > 99 ? 3.0 : 2.0;
        float slot = (p.x + 0.24 * count) / 0.48;
        int at = int(floor(slot));
        vec2 q = vec2((fract(slot) - 0.5) * 2.4, p.y / 0.42);
        int value = number > 99 ? (at == 0 ? number / 100 : at == 1 ? (number / 10) % 10 : number % 10)
                                : (at == 0 ? number / 10 : number % 10);
        ink = (slot >= 0.0 && slot < count && number > 0) ? glyph(digit(value), q) : 0.0;
    }
    if (shape > 0.0) discard;
    vec3 c = mix(face, ink_colour, ink);
    c = shape > rim ? border : c;
    c = v_face.x < -0.5 ? c : vec3(0.45);
    vec3 n = normalize(v_normal);
    vec3 light = light_at(v_place, n, 1.0);
    // Signs are retro-reflective: lit by one's own lamps they are bright.
    vec2 d = v_place.xy - u_ego.xy;
    float ahead = dot(normalize(d), u_ego.zw);
    light += vec3(u_head * smoothstep(0.7, 0.95, ahead) * exp(-length(d) / 60.0) * 0.9);
    out_colour = graded(finish(c * light, v_place));
}

//// GROUND_VERTEX
#version 330
uniform mat4 u_clip;
in vec2 in_place;
in vec2 in_lane;
in vec4 in_info;  // half width, left and right marking, kind
out vec3 v_place;
out vec2 v_lane;
flat out vec4 v_info;
out float v_depth;
void main() {
    // What lies on top lies a few mm higher: seen from a camera that is far apart in depth.
    float kind = in_info.w;
    float low = kind < 0.5 ? 0.020 : kind < 1.5 ? 0.0 : kind < 2.5 ? 0.006 : kind < 3.5 ? 0.014 : kind < 5.5 ? -0.004
              : kind < 6.5 ? (in_info.x > 100.0 ? 0.006 : 0.0) : kind < 7.5 ? 0.0 : kind < 8.5 ? 0.010 : -0.004;
    v_place = vec3(in_place, -low);
    v_lane = in_lane;
    v_info = in_info;
    gl_Position = u_clip * vec4(v_place, 1.0);
    v_depth = gl_Position.w;
}

//// MARKING
float between(float x, float w, float low, float high) {  // share of a pixel of width w about x
    return clamp((min(x + 0.5 * w, high) - max(x - 0.5 * w, low)) / w, 0.0, 1.0);
}
float dashes(float s, float w, float on, float period) {
    float f = mod(s, period);
    float near = clamp((on * 0.5 - abs(f - on * 0.5)) / max(w, 1e-4) + 0.5, 0.0, 1.0);
    return mix(near, on / period, smoothstep(0.3, 0.8, w / period));
}
// Share of white, share of yellow at distance e from an edge with a marking.
vec2 marking(float code, float e, float w, float s, float ws) {
    float line = between(e, w, 0.0, 0.075);
    float outer = between(e, w, 0.08, 0.24);
    vec2 found = vec2(0.0);
    found.x += float(abs(code - 1.0) < 0.5) * line * dashes(s, ws, 3.0, 9.0);
    found.x += float(abs(code - 2.0) < 0.5) * line;
    found.y += float(abs(code - 3.0) < 0.5) * between(e, w, 0.05, 0.17);
    found.y += float(abs(code - 4.0) < 0.5) * outer;
    found.x += float(abs(code - 5.0) < 0.5) * outer;
    return found;
}
vec2 markings(vec2 lane, vec4 info) {
    float w = fwidth(lane.y) + 1e-4, ws = fwidth(lane.x) + 1e-4;
    return marking(info.y, info.x - lane.y, w, lane.x, ws) + marking(info.z, info.x + lane.y, w, lane.x, ws);
}
float zebra(vec2 lane, vec4 info) {
    float w = fwidth(lane.x) + 1e-4;
    float bars = dashes(lane.x, w, 0.5, 1.0);
    float teeth = float(info.w > 8.5);
    return mix(float(info.w > 4.5) + float(info.w < 4.5) * bars, bars, teeth);
}

//// GROUND_HEAD
#version 330
#include LIGHT

in vec3 v_place;
in vec2 v_lane;
flat in vec4 v_info;
out vec4 out_colour;
uniform vec3 u_terrain;
uniform vec3 u_horizon;
vec3 road_light(vec3 c, float rough, float puddle) {
    float sun = sunlit(v_place);
    vec3 lit = c * light_at(v_place, vec3(0.0, 0.0, 1.0), sun);
    vec3 to = u_cam - v_place;
    float cosine = to.z / length(to);
    float fresnel = u_wet * (0.06 + 0.80 * pow(1.0 - cosine, 4.0)) * (0.55 + 0.75 * puddle) * (1.0 - rough);
    return finish(mix(lit, u_horizon, clamp(fresnel, 0.0, 0.85)), v_place);
}

//// TERRAIN_FRAGMENT
#include GROUND_HEAD

void main() {
    float a = texture(u_noise, v_place.xy * 0.013).r, b = texture(u_noise, v_place.yx * 0.21).r;
    vec3 c = u_terrain * (0.62 + 0.5 * a + 0.3 * b);
    float cover = clamp(u_snow * 2.6 - 0.5 * b + 0.1, 0.0, 1.0) * step(0.01, u_snow);
    c = mix(c, vec3(0.90, 0.92, 0.96) * (0.93 + 0.1 * b), cover);
    c *= 1.0 - 0.25 * u_wet;
    out_colour = graded(road_light(c, 0.85, b));
}

//// PAVEMENT_FRAGMENT
#include GROUND_HEAD

void main() {
    float kind = v_info.w;
    float a = texture(u_noise, v_place.xy * 0.037).r, b = texture(u_noise, v_place.yx * 0.61).r;
    float walk = float(abs(kind - 3.0) < 0.5), kerb = float(abs(kind - 8.0) < 0.5);
    vec3 c = mix(vec3(0.270, 0.272, 0.280), vec3(0.56, 0.55, 0.53), walk);
    c = mix(c, vec3(0.68, 0.67, 0.65), kerb);
    c *= 0.86 + 0.16 * a + 0.16 * b;
    vec2 tile = fract(v_lane / 1.5), w = fwidth(v_lane / 1.5) + 1e-3;
    float joint = max(step(tile.x, 0.035), step(tile.y, 0.035)) * (1.0 - smoothstep(0.1, 0.4, max(w.x, w.y)));
    c *= 1.0 - 0.2 * joint * walk;
    c *= 1.0 - 0.42 * u_wet;
    float cover = clamp(u_snow * 1.7 - 0.55 * a - 0.35 * b + 0.25 * (walk + kerb), 0.0, 1.0) * step(0.01, u_snow);
    c = mix(c, vec3(0.86, 0.88, 0.92), cover);
    out_colour = graded(road_light(c, 0.5 * (walk + kerb), smoothstep(0.45, 0.75, a)));
}

//// LANE_FRAGMENT
#include GROUND_HEAD
#include MARKING

void main() {
    float kind = v_info.w;
    float a = texture(u_noise, v_place.xy * 0.037).r, b = texture(u_noise, v_place.yx * 0.61).r;
    float track = exp(-pow((abs(v_lane.y) - 0.85) / 0.28, 2.0));
    vec3 c = mix(vec3(0.275, 0.277, 0.285), vec3(0.46, 0.20, 0.16), float(abs(kind - 7.0) < 0.5));
    c *= 0.88 + 0.16 * a + 0.16 * b - 0.06 * track;
    c *= 1.0 - 0.45 * u_wet;
    vec2 m = markings(v_lane, v_info);
    float worn = 0.90 - 0.25 * b * a;
    c = mix(c, vec3(0.88) * (1.0 - 0.12 * u_wet), m.x * worn);
    c = mix(c, vec3(0.88, 0.66, 0.12) * (1.0 - 0.12 * u_wet), m.y * worn);
    float cover = clamp(u_snow * 1.75 - 0.45 * a - 0.35 * b - 0.75 * track * (1.0 - 0.5 * u_snow) + 0.1, 0.0, 0.96);
    c = mix(c, vec3(0.84, 0.86, 0.90), cover * step(0.01, u_snow));
    out_colour = graded(road_light(c, 0.0, smoothstep(0.42, 0.75, a)));
}

//// PAINT_FRAGMENT
#include GROUND_HEAD
#include MARKING

void main() {
    float b = texture(u_noise, v_place.yx * 0.61).r;
    float share = zebra(v_lane, v_info);
    vec3 c = mix(vec3(0.25) * (1.0 - 0.4 * u_wet), vec3(0.86) * (0.85 + 0.2 * b), share);
    c = mix(c, vec3(0.84, 0.86, 0.90), clamp(u_snow * 1.2 - 0.4 * b, 0.0, 0.85) * step(0.01, u_snow));
    out_colour = graded(road_light(c, 0.2, b));
}

//// SKY_VERTEX
#version 330
uniform mat4 u_unproject;
out vec3 v_ray;
void main() {
    vec2 p = vec2((gl_VertexID & 1) * 4 - 1, (gl_VertexID >> 1) * 4 - 1);
    gl_Position = vec4(p, 0.9999999, 1.0);
    v_ray = (u_unproject * vec4(p, 1.0, 1.0)).xyz;
}

//// SKY_FRAGMENT
#version 330
#include LIGHT

uniform vec3 u_zenith;
uniform vec3 u_horizon;
uniform float u_cloud;
uniform float u_mist;
in vec3 v_ray;
out vec4 out_colour;
void main() {
    vec3 r = normalize(v_ray);
    float up = max(r.z, 0.0);
    vec3 c = mix(u_horizon, u_zenith, 1.0 - exp(-3.2 * up));
    vec2 q = r.xy / (up + 0.12);
    float a = texture(u_noise, q * 0.045).r, b = texture(u_noise, q * 0.16 + 0.3).r;
    float density = 0.65 * a + 0.35 * b;
    float puff = smoothstep(0.52, 0.72, density) * smoothstep(0.0, 0.12, up) * (1.0 - u_cloud);
    c = mix(c, u_horizon * 0.25 + vec3(0.78) * (1.0 - 0.93 * u_night), puff * 0.75);
    c *= 1.0 - u_cloud * 0.22 * (density - 0.35);
    float sun = max(dot(r, u_sun), 0.0);
    float clear = (1.0 - u_cloud) * (1.0 - puff * 0.7);
    c += u_sun_light * clear * (0.35 * pow(sun, 60.0) + step(0.9993, sun) * 1.2);
    float star = step(0.9965, fract(sin(dot(floor(r * 160.0), vec3(12.99, 78.2, 37.7))) * 43758.5)) * step(0.05, r.z);
    c += vec3(star * 0.5 * u_night * u_night * (1.0 - u_cloud));
    float azimuth = atan(r.y, r.x);
    float hills = 0.040 + 0.013 * sin(azimuth * 3.0 + 1.0) + 0.009 * sin(azimuth * 7.0) + 0.0035 * sin(azimuth * 41.0);
    float under = step(r.z, hills);
    vec3 forest = mix(vec3(0.23, 0.31, 0.27), vec3(0.80, 0.83, 0.87), min(1.0, u_snow * 0.9)) * u_sky_light;
    c = mix(c, mix(u_air, forest, 0.55 * exp(-700.0 * u_extinction)), under);
    c = mix(c, u_air, u_mist * exp(-2.2 * up));
    out_colour = graded(c);
}

//// GLOW_VERTEX
#version 330
uniform mat4 u_clip;
uniform vec3 u_cam;
uniform vec3 u_right;
uniform vec3 u_up;
in vec2 in_corner;
in vec3 i_place;
in vec3 i_ax;
in vec3 i_ay;
in vec4 i_colour;
in float i_kind;
out vec2 v_corner;
out vec3 v_place;
flat out vec4 v_colour;
flat out float v_kind;
void main() {
    v_corner = in_corner;
    v_kind = i_kind;
    vec4 colour = i_colour;
    vec3 p = i_place + in_corner.x * i_ax + in_corner.y * i_ay;
    if (i_kind > 2.5 && i_kind < 3.5) {
        vec2 d = u_cam.xy - i_place.xy;
        float far = length(d);
        float t = i_place.z / (i_place.z + u_cam.z);
        float s = clamp(t + in_corner.x * 0.32, 0.02, 0.97);
        d /= far;
        p = vec3(i_place.xy + d * (s * far) + vec2(-d.y, d.x) * (in_corner.y * i_ax.x * (1.0 + 0.01 * far)), 0.03);
    } else if (i_kind > 0.5 && i_kind < 1.5 || i_kind > 3.5) {
        vec3 d = u_cam - i_place;
        float far = length(d);
        float size = i_ax.x * (1.0 + 0.012 * far);
        p = i_place + (u_right * in_corner.x + u_up * in_corner.y) * size + d / far * 0.12;
        if (i_kind > 3.5) colour *= smoothstep(0.0, 0.6, dot(vec2(cos(i_ay.x), sin(i_ay.x)), d.xy / length(d.xy)));
    }
    v_place = p;
    v_colour = colour;
    gl_Position = u_clip * vec4(p, 1.0);
}

//// GLOW_FRAGMENT
#version 330
uniform vec3 u_cam;
uniform float u_extinction;
uniform vec3 u_grade;
in vec2 v_corner;
in vec3 v_place;
flat in vec4 v_colour;
flat in float v_kind;
out vec4 out_colour;
void main() {
    float soft = max(0.0, 1.0 - dot(v_corner, v_corner));
    soft *= mix(soft, 1.0, float(v_kind > 1.5 && v_kind < 2.5) * 0.5);
    float through = exp(-0.6 * u_extinction * length(v_place - u_cam));
    out_colour = v_colour * (soft * through * mix(1.0, u_grade.x, float(v_colour.a < 0.01)));
}

//// FALL_VERTEX
#version 330
in vec2 in_corner;
in vec4 i_at;     // place and half size on the screen, normalised
in vec4 i_look;   // colour and opacity
in float i_slant;
out vec2 v_corner;
flat out vec4 v_look;
void main() {
    v_corner = in_corner;
    v_look = i_look;
    vec2 p = i_at.xy + in_corner * i_at.zw;
    p.x += i_slant * in_corner.y * i_at.w;
    gl_Position = vec4(p, 0.0, 1.0);
}

//// FALL_FRAGMENT
#version 330
in vec2 v_corner;
flat in vec4 v_look;
out vec4 out_colour;
void main() {
    float soft = max(0.0, 1.0 - dot(v_corner, v_corner));
    float a = v_look.a * soft;
    out_colour = vec4(v_look.rgb * a, a);
}

//// DEPTH_FRAGMENT
#version 330
void main() {}

//// TRUTH_SOLID_FRAGMENT
#version 330
flat in vec3 v_label;
in float v_depth;
layout(location = 0) out vec4 out_label;
layout(location = 1) out float out_depth;
void main() {
    out_label = vec4(v_label, 1.0);
    out_depth = v_depth;
}

//// TRUTH_GROUND_FRAGMENT
#version 330
#include MARKING

in vec3 v_place;
in vec2 v_lane;
flat in vec4 v_info;
in float v_depth;
layout(location = 0) out vec4 out_label;
layout(location = 1) out float out_depth;
void main() {
    float kind = v_info.w;
    vec2 m = markings(v_lane, v_info);
    float lane = float(abs(kind - 1.0) < 0.5 || abs(kind - 6.0) < 0.5 && v_info.x < 100.0);
    float label = 2.0;
    label = kind < 0.5 ? 1.0 : label;
    label = (abs(kind - 3.0) < 0.5 || abs(kind - 8.0) < 0.5) ? 5.0 : label;
    label = (lane > 0.5 && m.x + m.y > 0.5) ? 3.0 : label;
    label = abs(kind - 4.0) < 0.5 ? 4.0 : label;
    label = (abs(kind - 5.0) < 0.5 || kind > 8.5) ? 3.0 : label;
    out_label = vec4(0.0, 0.0, label / 255.0, 1.0);
    out_depth = v_depth;
}
