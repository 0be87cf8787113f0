/// tessera-keys: makes, renews and revokes the keys of a wall.
#include "server/tools/keys/KeysCommand.h"

int main(int argc, char** argv) {
    return tessera::runKeys({argv + 1, argv + argc});
}
