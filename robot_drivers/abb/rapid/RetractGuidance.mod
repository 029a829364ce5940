MODULE RetractGuidance
    ! Task T_ROB1, option EGM, instead of RetractMotion: the PC generates every reference (see egm_guidance.py).
    ! The tool must stand in a fine point of a motion that was carried out since the controller started.

    ! Name of the UDPUC device
    LOCAL CONST string DEVICE:="UCdevice";
    LOCAL CONST pose IDENTITY:=[[0,0,0],[1,0,0,0]];
    ! Never converged, so that a tool that stands does not end the session
    LOCAL CONST egm_minmax NEVER:=[-1E-9,1E-9];
    ! Degrees/s of the fastest joint
    LOCAL CONST num FASTEST_JOINT:=10;

    LOCAL VAR egmident guidance;

    PROC main()
        EGMReset guidance;
        EGMGetId guidance;
        ! Without data for 0.2 s the controller stops by itself (event 41822)
        EGMSetupUC ROB_1,guidance,"default",DEVICE\Pose\CommTimeout:=0.2;
        ! Both frames are the work object, so references are poses of rtTool in rtWobj
        EGMActPose guidance\Tool:=rtTool\WObj:=rtWobj,IDENTITY,EGM_FRAME_WOBJ,IDENTITY,EGM_FRAME_WOBJ
            \x:=NEVER\y:=NEVER\z:=NEVER\rx:=NEVER\ry:=NEVER\rz:=NEVER\SampleRate:=4
            \MaxSpeedDeviation:=FASTEST_JOINT;
        EGMRunPose guidance,EGM_STOP_HOLD\x\y\z\rx\ry\rz\CondTime:=1000000\RampInTime:=0.5;
    ERROR
        ! Silence of the PC: the tool stands. No RETRY; the operator starts the program again.
        IF ERRNO=ERR_UDPUC_COMM THEN
            TPWrite "EGM: no data from the PC, guidance has ended";
            EGMReset guidance;
            Stop;
            RETURN;
        ENDIF
        RAISE;
    ENDPROC
ENDMODULE
