#version 330 core

// Gamma 2.0 stands for the sRGB curve: a square and a root instead of two powers. What is interpolated stays within the
// triangle (centroid): beyond its edge, light could be negative or far too bright.

in vec2 uv;
centroid in vec3 on_painting;
centroid in vec3 added;

uniform sampler2D painting;

out vec4 frag_color;

void main()
{
    vec3 texel = texture(painting, uv).rgb;
    frag_color = vec4(sqrt(texel * texel * on_painting + added), 1.0);
}
