/// tessera-check: what is wrong with scenes and walls.
#include "server/tools/CheckCommand.h"

int main(int argc, char** argv) {
    return tessera::runCheck({argv + 1, argv + argc});
}
