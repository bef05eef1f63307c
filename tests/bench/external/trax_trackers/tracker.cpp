// Tracker that speaks TraX, version 4 or 1: returns the init box.
// It checks the header of each BMP file, and ends with status 5 if it cannot be read.
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iostream>
#include <string>
#include <vector>

static std::vector<std::string> arguments(const std::string &line) {
    std::vector<std::string> found;
    size_t start = line.find('"');
    while (start != std::string::npos) {
        size_t stop = line.find('"', start + 1);
        found.push_back(line.substr(start + 1, stop - start - 1));
        start = line.find('"', stop + 1);
    }
    return found;
}

static int32_t width_of(const std::string &address) {
    std::ifstream file(address.substr(std::strlen("file://")), std::ios::binary);
    char header[26];
    int32_t width = 0;
    if (!file.read(header, sizeof header) || header[0] != 'B' || header[1] != 'M') {
        std::cerr << "cannot read " << address << std::endl;
        std::exit(5);
    }
    std::memcpy(&width, header + 18, sizeof width);
    return width;
}

int main(int, char **values) {
    const std::string version = values[1];
    std::cout << "a banner\n@@TRAX:hello \"trax.version=" << version
              << "\" \"trax.name=c++\" \"trax.image=path\" \"trax.region=polygon\"" << std::endl;
    std::string line, region;
    while (std::getline(std::cin, line)) {
        if (line.rfind("@@TRAX:quit", 0) == 0) break;
        std::vector<std::string> given = arguments(line);
        if (line.rfind("@@TRAX:initialize", 0) == 0) {
            region = given.at(version == "4" ? 0 : 1);
            if (version == "4") continue;  // the image follows in a message `frame`
        }
        int32_t width = width_of(given.at(0));
        std::cout << "width " << width << "\n@@TRAX:state \"" << region << "\"" << std::endl;
    }
}
