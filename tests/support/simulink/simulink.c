/* Runs a Simulink S-function for one step. The C file of the S-function includes simulink.c. */

/* Returns the number of written outputs, or -1 if the Simulink block has an error. The array
 * `inputs` contains the inputs of all ports in sequence, and the array `outputs` receives the
 * outputs of all ports. */
int simulate(const char *function, const double *inputs, double *outputs)
{
    SimStruct block = {0};
    int written = 0;
    block.parameter.text = function;
    mdlInitializeSizes(&block);
    if (block.error) {
        return -1;
    }
    mdlInitializeSampleTimes(&block);
    for (int k = 0; k < block.inputs; k++) {
        block.in[k] = inputs;
        inputs += block.widths[0][k];
    }
    for (int k = 0; k < block.outputs; k++) {
        block.out[k] = outputs + written;
        written += block.widths[1][k];
    }
    mdlOutputs(&block, 0);
    mdlTerminate(&block);
    return written;
}
