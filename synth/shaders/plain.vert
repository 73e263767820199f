#version 330 core

// Eyes, teeth and what else has its colours at the vertices only.

layout(location = 0) in vec3 position;
layout(location = NORMAL_LOC) in vec3 normal;
layout(location = TEXCOORD_1_LOC) in vec2 texcoord_1;   // strength and exponent of the highlight
layout(location = COLOR_0_LOC) in vec4 color_0;         // linear colour

uniform mat4 camera;

centroid out vec3 matt;
centroid out vec3 towards;
out vec2 gloss;

LIGHTING

void main()
{
    gl_Position = camera * vec4(position, 1.0);
    matt = color_0.rgb * diffuse(normal);
    towards = normal;
    gloss = texcoord_1;
}
