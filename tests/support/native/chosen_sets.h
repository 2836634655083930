/* Reports the instruction sets in the environment variable CHOSEN_SETS as available.
 *
 * This file is included first, so it declares getenv without a system header. Later files define
 * which declarations the system headers contain. */
extern char *getenv(const char *name);

static inline int chosen_sets_have(const char *set)
{
    const char *chosen = getenv("CHOSEN_SETS");
    return chosen && __builtin_strstr(chosen, set);
}
