#version 330 core

// Skin, hair and clothes: the painting under light that is known at the vertices, whose mesh is fine enough for it.

layout(location = 0) in vec3 position;
layout(location = NORMAL_LOC) in vec3 normal;
layout(location = TEXCOORD_0_LOC) in vec2 texcoord_0;
layout(location = TEXCOORD_1_LOC) in vec2 texcoord_1;   // strength and exponent of the highlight
layout(location = COLOR_0_LOC) in vec4 color_0;         // linear colour times its cover; weight of the painting

uniform mat4 camera;

out vec2 uv;
centroid out vec3 on_painting;   // light on the painting
centroid out vec3 added;         // light from the own colour and the highlights

LIGHTING

void main()
{
    gl_Position = camera * vec4(position, 1.0);
    vec3 light = diffuse(normal);
    uv = texcoord_0;
    on_painting = color_0.a * light;
    added = color_0.rgb * light + shine(normal, texcoord_1);
}
