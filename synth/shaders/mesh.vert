#version 330 core

layout(location = 0) in vec3 position;
layout(location = NORMAL_LOC) in vec3 normal;
layout(location = TEXCOORD_0_LOC) in vec2 texcoord_0;
layout(location = TEXCOORD_1_LOC) in vec2 texcoord_1;
layout(location = COLOR_0_LOC) in vec4 color_0;

uniform mat4 V;
uniform mat4 P;

out vec3 towards;
out vec2 uv;
out vec2 gloss;
out vec4 paint;

void main()
{
    gl_Position = P * V * vec4(position, 1.0);
    towards = normal;
    uv = texcoord_0;
    gloss = texcoord_1;
    paint = color_0;
}
