// Three lights, as in a studio: a warm key light from the left front, a cool fill light from the right, a light from behind.

const vec3 KEY = vec3(0.4286, 0.4682, 0.7726);
const vec3 FILL = vec3(-0.7428, 0.1094, 0.6605);
const vec3 RIM = vec3(-0.4391, 0.5269, -0.7278);
// Half-way to the camera, which is far enough to be in one direction.
const vec3 KEY_HALF = vec3(0.2276, 0.2487, 0.9415);
const vec3 FILL_HALF = vec3(-0.4076, 0.0600, 0.9112);
const vec3 KEY_COLOUR = vec3(1.02, 0.96, 0.90);
const vec3 FILL_COLOUR = vec3(0.34, 0.37, 0.42);
const vec3 RIM_COLOUR = vec3(0.40, 0.42, 0.46);
const float EXPOSURE = 0.80;

// Light bleeds round the terminator, red further than blue, as under skin.
vec3 wrapped(float cosine)
{
    const vec3 reach = vec3(0.42, 0.26, 0.20);
    return max(vec3(0.0), (cosine + reach) / (1.0 + reach));
}

// What a matt white place with the unit normal n sends to the camera.
vec3 diffuse(vec3 n)
{
    vec3 ambient = mix(vec3(0.22, 0.19, 0.18), vec3(0.31, 0.33, 0.36), 0.5 + 0.5 * n.y);
    return EXPOSURE * (ambient + KEY_COLOUR * wrapped(dot(n, KEY)) + FILL_COLOUR * wrapped(dot(n, FILL))
        + RIM_COLOUR * max(0.0, dot(n, RIM)));
}

// Schlick's stand-in for the power function, squared to shorten its tail.
float power(float base, float exponent)
{
    float root = base / (0.5 * exponent * (1.0 - base) + base);
    return root * root;
}

// The highlights; gloss is their strength and exponent.
vec3 shine(vec3 n, vec2 gloss)
{
    float key = power(max(0.0, dot(n, KEY_HALF)), gloss.y);
    float fill = power(max(0.0, dot(n, FILL_HALF)), gloss.y);
    float edge = 1.0 - max(0.0, n.z);
    return gloss.x * (key * KEY_COLOUR + fill * FILL_COLOUR + 0.25 * edge * edge * edge * edge);
}
