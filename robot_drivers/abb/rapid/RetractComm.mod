MODULE RetractComm
    ! Task T_COMM: the command server and the watchdog. It alone starts, stops and allows motion.

    LOCAL CONST string BLANKS:="                                                                ";

    LOCAL VAR socketdev listener;
    LOCAL VAR socketdev client;
    LOCAL VAR string clientAddress;
    LOCAL VAR bool connected;
    LOCAL VAR clock silence;
    LOCAL VAR clock sinceAbort;

    ! The request in hand
    LOCAL VAR rawbytes request;
    LOCAL VAR num seq;
    LOCAL VAR num command;
    LOCAL VAR num number{12};

    ! Limits of this session: those installed, narrowed by the client
    LOCAL VAR pos low;
    LOCAL VAR pos high;
    LOCAL VAR num maxStep;
    LOCAL VAR num maxTurn;
    LOCAL VAR num maxSpeed;
    LOCAL VAR num maxTurningSpeed;

    ! The last MOVE_L: open until its end was found, and the final answer to it
    LOCAL VAR bool moveOpen:=FALSE;
    LOCAL VAR bool replyDue:=FALSE;
    LOCAL VAR num abortCode:=0;
    LOCAL VAR num finalKind:=REPLY_ABORTED;
    LOCAL VAR num finalCode:=CODE_PROGRAM_STOPPED;
    LOCAL VAR num finalDetail:=0;
    ! Sequence number of a STOP that waits for standstill, 0 for none
    LOCAL VAR num stopSeq:=0;
    ! Explains a refusal
    LOCAL VAR num detail:=0;

    PROC main()
        IF rtMoveBusy StopMotion CODE_WATCHDOG;
        rtListen listener,RT_COMMAND_PORT;
        WHILE TRUE DO
            SocketClose client;
            SocketAccept listener,client\ClientAddress:=clientAddress\Time:=WAIT_MAX;
            IF clientAddress=RT_CLIENT_IP ServeClient;
        ENDWHILE
    ERROR
        ! Sockets only: begin anew. Nothing moves here, a motion was stopped when its client went.
        SocketClose client;
        WaitTime 1;
        ExitCycle;
    ENDPROC

    LOCAL PROC ServeClient()
        BeginSession;
        WHILE connected DO
            IF RequestReceived() THEN
                RestartClock silence;
                AnswerRequest;
            ENDIF
            IF ClkRead(silence)>RT_SILENCE_TIME connected:=FALSE;
            WatchMotion;
            ReportMotion;
            ReportStop;
        ENDWHILE
        IF rtMoveBusy StopMotion CODE_WATCHDOG;
    ERROR
        ! The client has gone: the loop ends, the motion is stopped behind it
        IF ERRNO=ERR_SOCK_CLOSED THEN
            SkipWarn;
            connected:=FALSE;
            TRYNEXT;
        ENDIF
        RAISE;
    ENDPROC

    ! No answer that an earlier client waited for goes to this one
    LOCAL PROC BeginSession()
        connected:=TRUE;
        replyDue:=FALSE;
        stopSeq:=0;
        RestartClock silence;
        TakeInstalledLimits;
    ENDPROC

    LOCAL PROC RestartClock(VAR clock timer)
        ClkStop timer;
        ClkReset timer;
        ClkStart timer;
    ENDPROC

    LOCAL FUNC bool RequestReceived()
        SocketReceive client\RawData:=request\ReadNoOfBytes:=RT_REQUEST_BYTES\Time:=0.02;
        RETURN TRUE;
    ERROR
        IF ERRNO=ERR_SOCK_TIMEOUT THEN
            SkipWarn;
            RETURN FALSE;
        ENDIF
        RAISE;
    ENDFUNC

    LOCAL PROC AnswerRequest()
        VAR num length;
        UnpackRawBytes request,1,length\IntX:=UDINT;
        IF length<>RT_REQUEST_BYTES-4 THEN
            ! The place in the stream is lost
            connected:=FALSE;
            RETURN;
        ENDIF
        UnpackRawBytes request,5,seq\IntX:=UDINT;
        UnpackRawBytes request,9,command\IntX:=UDINT;
        FOR i FROM 1 TO 12 DO
            UnpackRawBytes request,13+4*i,number{i}\Float4;
        ENDFOR
        TEST command
        CASE CMD_HELLO:
            TakeInstalledLimits;
            SendReply REPLY_DONE,seq,CODE_OK,RT_PROTOCOL_VERSION;
        CASE CMD_GET_STATE:
            SendReply REPLY_DONE,seq,CODE_OK,0;
        CASE CMD_IDENTIFY:
            SendIdentity;
        CASE CMD_SET_LIMITS:
            SetLimits;
        CASE CMD_MOVE_L:
            BeginMove;
        CASE CMD_STOP:
            StopMotion CODE_STOPPED;
            SendReply REPLY_ACCEPTED,seq,CODE_OK,0;
            stopSeq:=seq;
        CASE CMD_RESUME:
            AllowMotion;
        DEFAULT:
            SendReply REPLY_REJECTED,seq,CODE_UNKNOWN_COMMAND,0;
        ENDTEST
    ENDPROC

    LOCAL PROC TakeInstalledLimits()
        low:=RT_BOX_LOW;
        high:=RT_BOX_HIGH;
        maxStep:=RT_MAX_STEP;
        maxTurn:=RT_MAX_TURN;
        maxSpeed:=RT_MAX_SPEED;
        maxTurningSpeed:=RT_MAX_TURNING_SPEED;
    ENDPROC

    LOCAL PROC SetLimits()
        TakeInstalledLimits;
        low.x:=Larger(low.x,number{1});
        low.y:=Larger(low.y,number{2});
        low.z:=Larger(low.z,number{3});
        high.x:=Smaller(high.x,number{4});
        high.y:=Smaller(high.y,number{5});
        high.z:=Smaller(high.z,number{6});
        maxStep:=Smaller(maxStep,number{7});
        maxTurn:=Smaller(maxTurn,number{8});
        maxSpeed:=Smaller(maxSpeed,number{9});
        maxTurningSpeed:=Smaller(maxTurningSpeed,number{10});
        IF low.x<high.x AND low.y<high.y AND low.z<high.z AND maxStep>0 AND maxTurn>0
            AND maxSpeed>0 AND maxTurningSpeed>0 THEN
            SendReply REPLY_DONE,seq,CODE_OK,0;
        ELSE
            TakeInstalledLimits;
            SendReply REPLY_REJECTED,seq,CODE_BAD_LIMITS,0;
        ENDIF
    ENDPROC

    LOCAL FUNC num Larger(num a,num b)
        IF a>b RETURN a;
        RETURN b;
    ENDFUNC

    LOCAL FUNC num Smaller(num a,num b)
        IF a<b RETURN a;
        RETURN b;
    ENDFUNC

    LOCAL PROC BeginMove()
        VAR num code;
        VAR robtarget target;
        IF seq=rtMoveSeq AND seq<>0 THEN
            ! The same order again: answer again, move nothing
            IF moveOpen THEN
                replyDue:=TRUE;
                SendReply REPLY_ACCEPTED,seq,CODE_OK,0;
            ELSE
                SendReply finalKind,seq,finalCode,finalDetail;
            ENDIF
            RETURN;
        ENDIF
        ! Only position and orientation change; configuration and external axes are those of now
        target:=CRobT(\TaskRef:=T_ROB1Id\Tool:=rtTool\WObj:=rtWobj);
        detail:=0;
        code:=Refusal(target);
        IF code<>CODE_OK THEN
            SendReply REPLY_REJECTED,seq,code,detail;
            RETURN;
        ENDIF
        target.trans:=[number{1},number{2},number{3}];
        target.rot:=NOrient([number{4},number{5},number{6},number{7}]);
        rtMoveSeq:=seq;
        rtTarget:=target;
        rtSpeed:=[number{8},number{9},10,10];
        rtArrived:=FALSE;
        rtMoveErrno:=0;
        abortCode:=CODE_OK;
        moveOpen:=TRUE;
        replyDue:=TRUE;
        rtMoveBusy:=TRUE;
        rtMovePending:=TRUE;
        SendReply REPLY_ACCEPTED,seq,CODE_OK,0;
    ENDPROC

    ! The first rule that forbids the motion, CODE_OK if none does. Every comparison is written so that a
    ! number that is none fails it.
    LOCAL FUNC num Refusal(robtarget here)
        VAR pos target;
        VAR num norm;
        VAR num turn;
        IF seq<>(rtMoveSeq MOD RT_MOVE_SEQUENCES)+1 RETURN CODE_OUT_OF_SEQUENCE;
        IF NOT rtReady() RETURN CODE_NOT_READY;
        IF rtHolding RETURN CODE_HOLDING;
        IF rtMoveBusy OR moveOpen RETURN CODE_BUSY;
        norm:=Sqrt(Square(number{4})+Square(number{5})+Square(number{6})+Square(number{7}));
        IF NOT (norm>0.999 AND norm<1.001) RETURN CODE_BAD_TARGET;
        target:=[number{1},number{2},number{3}];
        detail:=Distance(here.trans,target);
        IF NOT (detail<=maxStep) RETURN CODE_STEP_TOO_LONG;
        turn:=2*ACos(Smaller(1,Abs(here.rot.q1*number{4}+here.rot.q2*number{5}
            +here.rot.q3*number{6}+here.rot.q4*number{7})));
        detail:=turn;
        IF NOT (turn<=maxTurn) RETURN CODE_TURN_TOO_LARGE;
        detail:=1;
        IF NOT (target.x>=low.x AND target.x<=high.x) RETURN CODE_OUTSIDE_WORKSPACE;
        detail:=2;
        IF NOT (target.y>=low.y AND target.y<=high.y) RETURN CODE_OUTSIDE_WORKSPACE;
        detail:=3;
        IF NOT (target.z>=low.z AND target.z<=high.z) RETURN CODE_OUTSIDE_WORKSPACE;
        detail:=1;
        IF NOT (number{8}>0 AND number{8}<=maxSpeed) RETURN CODE_TOO_FAST;
        detail:=2;
        IF NOT (number{9}>0 AND number{9}<=maxTurningSpeed) RETURN CODE_TOO_FAST;
        detail:=0;
        RETURN CODE_OK;
    ENDFUNC

    LOCAL FUNC num Square(num x)
        RETURN x*x;
    ENDFUNC

    ! Stops at once. Motion needs RESUME after it.
    LOCAL PROC StopMotion(num code)
        StopMove\Quick\AllMotionTasks;
        rtHolding:=TRUE;
        IF moveOpen AND abortCode=CODE_OK abortCode:=code;
        OrderAbort;
    ENDPROC

    LOCAL PROC OrderAbort()
        rtAbortCount:=(rtAbortCount+1) MOD 1000;
        RestartClock sinceAbort;
    ENDPROC

    LOCAL PROC AllowMotion()
        IF NOT rtReady() THEN
            SendReply REPLY_REJECTED,seq,CODE_NOT_READY,0;
            RETURN;
        ENDIF
        IF rtMoveBusy OR moveOpen OR stopSeq<>0 THEN
            SendReply REPLY_REJECTED,seq,CODE_BUSY,0;
            RETURN;
        ENDIF
        ! The path is empty, so this moves nothing
        StartMove\AllMotionTasks;
        rtHolding:=FALSE;
        rtWatchdogTripped:=FALSE;
        rtMotionError:=FALSE;
        SendReply REPLY_DONE,seq,CODE_OK,0;
    ERROR
        IF ERRNO=ERR_SOCK_CLOSED RAISE;
        rtHolding:=TRUE;
        SendReply REPLY_REJECTED,seq,CODE_MOTION_ERROR,ERRNO;
        RETURN;
    ENDPROC

    LOCAL PROC WatchMotion()
        IF rtMoveBusy AND NOT rtHolding THEN
            IF ClkRead(silence)>RT_WATCHDOG_TIME THEN
                rtWatchdogTripped:=TRUE;
                StopMotion CODE_WATCHDOG;
            ELSEIF NOT rtReady() THEN
                ! Stopped by the pendant, an emergency stop, a collision: a restart must not finish the line
                StopMotion CODE_PROGRAM_STOPPED;
            ENDIF
        ENDIF
        ! An abort ordered while T_ROB1 did not run was not heard
        IF rtMoveBusy AND rtHolding AND rtReady() AND ClkRead(sinceAbort)>0.5 OrderAbort;
    ENDPROC

    LOCAL PROC ReportMotion()
        IF NOT moveOpen RETURN;
        ! Without its program T_ROB1 cannot say that it has finished; a standing arm has
        IF rtMoveBusy AND (abortCode=CODE_OK OR rtReady() OR DOutput(soRetractStandstill)=0) RETURN;
        moveOpen:=FALSE;
        IF abortCode<>CODE_OK THEN
            finalKind:=REPLY_ABORTED;
            finalCode:=abortCode;
            finalDetail:=0;
        ELSEIF rtArrived THEN
            finalKind:=REPLY_DONE;
            finalCode:=CODE_OK;
            finalDetail:=0;
        ELSE
            finalKind:=REPLY_ABORTED;
            finalCode:=CODE_MOTION_ERROR;
            finalDetail:=rtMoveErrno;
            rtMotionError:=TRUE;
            rtHolding:=TRUE;
        ENDIF
        IF replyDue THEN
            replyDue:=FALSE;
            SendReply finalKind,rtMoveSeq,finalCode,finalDetail;
        ENDIF
    ENDPROC

    LOCAL PROC ReportStop()
        VAR num stopped;
        IF stopSeq=0 OR moveOpen OR DOutput(soRetractStandstill)=0 RETURN;
        stopped:=stopSeq;
        stopSeq:=0;
        SendReply REPLY_DONE,stopped,CODE_OK,0;
    ENDPROC

    LOCAL PROC SendReply(num kind,num requestSeq,num code,num codeDetail)
        VAR rawbytes reply;
        rtPackHeader reply,RT_REPLY_BYTES,NumToDnum(requestSeq),kind;
        PackRawBytes code,reply,17\Float4;
        PackRawBytes codeDetail,reply,21\Float4;
        rtPackRobot reply,25;
        PackRawBytes rtMoveSeq,reply,77\Float4;
        SocketSend client\RawData:=reply;
    ENDPROC

    LOCAL PROC SendIdentity()
        VAR rawbytes reply;
        VAR string words;
        words:=GetSysInfo(\SerialNo)+"*"+GetSysInfo(\SWVersion)+"*"+GetSysInfo(\RobotType);
        IF StrLen(words)<RT_TEXT_BYTES words:=words+StrPart(BLANKS,1,RT_TEXT_BYTES-StrLen(words));
        rtPackHeader reply,RT_REPLY_BYTES,NumToDnum(seq),REPLY_TEXT;
        PackRawBytes StrPart(words,1,RT_TEXT_BYTES),reply,17\ASCII;
        SocketSend client\RawData:=reply;
    ENDPROC
ENDMODULE
