#version 330 core

// Gamma 2.0 stands for the sRGB curve: a square and a root instead of two powers.

in vec3 towards;
in vec2 uv;
in vec2 gloss;   // strength and exponent of the highlight
in vec4 paint;   // linear colour, already multiplied by its cover; weight of the texture

struct Material { sampler2D base_color_texture; };
uniform Material material;

out vec4 frag_color;

const vec3 KEY = vec3(0.4286, 0.4682, 0.7726);
const vec3 FILL = vec3(-0.7428, 0.1094, 0.6605);
const vec3 RIM = vec3(-0.4391, 0.5269, -0.7278);
// Half-way to the camera, which is far enough to be in one direction.
const vec3 KEY_HALF = vec3(0.2276, 0.2487, 0.9415);
const vec3 FILL_HALF = vec3(-0.4076, 0.0600, 0.9112);
const vec3 KEY_COLOUR = vec3(1.02, 0.96, 0.90);
const vec3 FILL_COLOUR = vec3(0.34, 0.37, 0.42);
const vec3 RIM_COLOUR = vec3(0.40, 0.42, 0.46);

// Light bleeds round the terminator, red further than blue, as under skin.
vec3 wrapped(float cosine)
{
    const vec3 reach = vec3(0.42, 0.26, 0.20);
    return max(vec3(0.0), (cosine + reach) / (1.0 + reach));
}

// Schlick's stand-in for the power function, squared to shorten its tail.
float power(float base, float exponent)
{
    float root = base / (0.5 * exponent * (1.0 - base) + base);
    return root * root;
}

void main()
{
    vec3 n = normalize(towards);
    vec3 texel = texture(material.base_color_texture, uv).rgb;
    vec3 albedo = texel * texel * paint.a + paint.rgb;

    vec3 ambient = mix(vec3(0.22, 0.19, 0.18), vec3(0.31, 0.33, 0.36), 0.5 + 0.5 * n.y);
    vec3 light = ambient + KEY_COLOUR * wrapped(dot(n, KEY)) + FILL_COLOUR * wrapped(dot(n, FILL))
        + RIM_COLOUR * max(0.0, dot(n, RIM));
    float key = power(max(0.0, dot(n, KEY_HALF)), gloss.y);
    float fill = power(max(0.0, dot(n, FILL_HALF)), gloss.y);
    float edge = 1.0 - max(0.0, n.z);
    vec3 shine = gloss.x * (key * KEY_COLOUR + fill * FILL_COLOUR + 0.25 * edge * edge * edge * edge);
    frag_color = vec4(sqrt(min(albedo * light * 0.80 + shine, vec3(1.0))), 1.0);
}
