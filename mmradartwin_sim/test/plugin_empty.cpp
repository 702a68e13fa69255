// A library that brings no mechanism.
extern "C" int mmradartwinEmptyPlugin() { return 0; }
