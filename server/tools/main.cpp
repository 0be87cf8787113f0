/// tessera-collide: the pairwise stage on two files.
#include "server/tools/CollideCommand.h"

int main(int argc, char** argv) {
    return tessera::runCollide({argv + 1, argv + argc});
}
