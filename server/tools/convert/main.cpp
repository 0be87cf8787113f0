/// tessera-convert: any readable scene to Tessera's own files.
#include "server/tools/ConvertCommand.h"

int main(int argc, char** argv) {
    return tessera::runConvert({argv + 1, argv + argc});
}
