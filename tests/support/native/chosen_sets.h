/* Instruction sets reported as available: those in the variable CHOSEN_SETS.
 *
 * It is read before all other files, which choose what the system's headers declare. */
extern char *getenv(const char *name);

static inline int chosen_sets_have(const char *set)
{
    const char *chosen = getenv("CHOSEN_SETS");
    return chosen && __builtin_strstr(chosen, set);
}
