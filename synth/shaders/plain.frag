#version 330 core

// Highlights on wet surfaces are too small for the vertices. Gamma as in painted.frag.

centroid in vec3 matt;
centroid in vec3 towards;
in vec2 gloss;

out vec4 frag_color;

LIGHTING

void main()
{
    frag_color = vec4(sqrt(matt + shine(normalize(towards), gloss)), 1.0);
}
